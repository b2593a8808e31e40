#include "deepuav/io/cameras/camera_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/io/testing/map_test_support.h"
#include "deepuav/map/atlas.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(CameraTable, OneLineAKeyframe) {
  Atlas atlas;
  Map& map = atlas.Add(TestMap(atlas.NextMap(), 5, 4, 4, 1, &atlas.ids()));
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / "camera_table_test.csv";
  const KeyframeId first = map.root();
  const GeoPoint origin{47.4, 8.5, 500};
  map.SetPose(first, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-1, 2, -3)));
  WriteCameraTable(file, map, {{first, "a, \"b\".jpg"}}, origin);
  const std::string with = ReadBytes(file, 1 << 20);
  EXPECT_THAT(with, StartsWith("image,time_ns,x,y,z,qx,qy,qz,qw,latitude_deg,longitude_deg,"));
  EXPECT_THAT(with, HasSubstr("\"a, \"\"b\"\".jpg\","));
  EXPECT_THAT(with, HasSubstr(",1.000000,-2.000000,3.000000,"));
  EXPECT_THAT(with, HasSubstr(",47.39998"));
  EXPECT_THAT(with, HasSubstr(",503.0000\n"));
  EXPECT_EQ(std::count(with.begin(), with.end(), '\n'), 1 + map.KeyframeCount());
  WriteCameraTable(file, map, {}, {});
  EXPECT_THAT(ReadBytes(file, 1 << 20), HasSubstr(",,,\n"));
  const Eigen::Vector3d nowhere(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  map.SetPose(first, SE3(Eigen::Quaterniond::Identity(), nowhere));
  EXPECT_THROW(WriteCameraTable(file, map, {}, {}), Error);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace deepuav
