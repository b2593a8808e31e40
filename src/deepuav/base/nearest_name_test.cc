#include "deepuav/base/nearest_name.h"

#include <gtest/gtest.h>

#include <vector>

namespace deepuav {
namespace {

TEST(NearestName, FindsTheSmallestEditDistance) {
  const std::vector<std::string> names = {"width", "height", "fx", "fy", "distortion"};
  EXPECT_EQ(NearestName("widht", names), "width");
  EXPECT_EQ(NearestName("Distortion_", names), "distortion");
  EXPECT_EQ(NearestName("f", names), "fx");
  EXPECT_EQ(NearestName("", names), "fx");
}

TEST(NearestName, OfNoCandidatesIsEmpty) { EXPECT_EQ(NearestName("width", {}), ""); }

TEST(NearestName, ManagesAVeryLongName) {
  const std::vector<std::string> names = {"aaaa", "bbbb"};
  EXPECT_EQ(NearestName(std::string(1000000, 'b'), names), "bbbb");
}

}  // namespace
}  // namespace deepuav
