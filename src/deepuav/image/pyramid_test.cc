#include "deepuav/image/pyramid.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

GreyImage Ramp(int width, int height) {
  GreyImage image(height, width);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) image(v, u) = static_cast<uint8_t>(2 * u + 4 * v);
  }
  return image;
}

TEST(ImagePyramidTest, PixelsAreMeansOfTheFinerLevel) {
  const ImagePyramid pyramid(Ramp(17, 9), 3);
  ASSERT_EQ(pyramid.levels(), 3);
  EXPECT_EQ(pyramid.level(1).size(), cv::Size(8, 4));
  EXPECT_EQ(pyramid.level(2).size(), cv::Size(4, 2));
  // The ramp's value at the pixel's place: (2 u + 0.5, 2 v + 0.5) and (4 u + 1.5, 4 v + 1.5).
  EXPECT_EQ(pyramid.level(1)(1, 3), 2 * 6.5 + 4 * 2.5);
  EXPECT_EQ(pyramid.level(2)(1, 2), 2 * 9.5 + 4 * 5.5);
}

TEST(ImagePyramidTest, TheFirstLevelIsTheImage) {
  const GreyImage image = Ramp(8, 8);
  EXPECT_EQ(ImagePyramid(image, 1).image().data, image.data);
}

TEST(ImagePyramidTest, StopsBeforeNothingIsLeft) {
  EXPECT_EQ(ImagePyramid(Ramp(9, 5), 5).levels(), 2);
  EXPECT_EQ(ImagePyramid(Ramp(1, 1), 5).levels(), 1);
}

TEST(ImagePyramidTest, RefusesNothing) {
  EXPECT_THROW(ImagePyramid(GreyImage(), 2), Error);
  EXPECT_THROW(ImagePyramid(Ramp(8, 8), 0), Error);
}

}  // namespace
}  // namespace deepuav
