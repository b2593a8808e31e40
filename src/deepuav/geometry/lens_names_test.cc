#include "deepuav/geometry/lens_names.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

TEST(LensNames, LeadThereAndBack) {
  const std::vector<std::string> names = LensModelNames();
  EXPECT_EQ(names.size(), 3u);
  for (const std::string& name : names) {
    const auto lens = LensModelOf(name);
    ASSERT_TRUE(lens) << name;
    EXPECT_EQ(NameOf(*lens), name);
  }
  EXPECT_EQ(NameOf(LensModel::kRadialTangential), "radial_tangential");
  EXPECT_EQ(LensModelOf("fisheye"), LensModel::kEquidistant);
  EXPECT_FALSE(LensModelOf("omni"));
  EXPECT_FALSE(LensModelOf(""));
}

}  // namespace
}  // namespace deepuav
