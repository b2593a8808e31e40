#include "deepuav/assembly/maps/loaded_maps.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

std::optional<double> Seen(const std::string& features, double network_pixels) {
  MapOrigin origin;
  origin.features = features;
  SuperPointOptions options;
  options.network_pixels = network_pixels;
  return PixelsSeenBefore(origin, options);
}

TEST(PixelsSeenBefore, CountWhereTheyAreFewerThanImagesWouldBeSeenAt) {
  EXPECT_EQ(Seen("superpoint_small int8 at 320x240", 400'000), 320 * 240);
  EXPECT_EQ(Seen("superpoint_small int8 at 320x240", 0), 320 * 240);
  EXPECT_EQ(Seen("one at 640x480; another at 320x240", 400'000), 320 * 240) << "the last counts";
  EXPECT_FALSE(Seen("superpoint_small int8 at 848x472", 400'000)) << "as any video is";
  EXPECT_FALSE(Seen("superpoint_small int8 at 320x240", 60'000));
  EXPECT_FALSE(Seen("superpoint_small int8", 400'000));
  EXPECT_FALSE(Seen("superpoint at 320x240 once", 400'000));
}

}  // namespace
}  // namespace deepuav
