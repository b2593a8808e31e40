#include "deepuav/base/error.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

TEST(Error, FormatsItsMessage) {
  const Error error("{}: {} is {}: expected {}", "camera.yaml", "fx", -2.5, "more than 0");
  EXPECT_STREQ(error.what(), "camera.yaml: fx is -2.5: expected more than 0");
}

TEST(Error, IsAStandardException) { EXPECT_THROW(throw Error("bad"), std::runtime_error); }

}  // namespace
}  // namespace deepuav
