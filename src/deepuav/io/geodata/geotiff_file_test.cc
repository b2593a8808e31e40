#include "deepuav/io/geodata/geotiff_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

class GeoTiffTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  size_t FilesInFolder() const {
    return static_cast<size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
  const GeoRaster raster_{
      .columns = 700, .rows = 600, .west = 464000.5, .north = 5.25e6, .cell = 0.25, .epsg = 32632};
};

TEST_F(GeoTiffTest, ColoursComeBack) {
  cv::Mat4b pixels(raster_.rows, raster_.columns);
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x)
      pixels(y, x) = cv::Vec4b(static_cast<uchar>(x), static_cast<uchar>(y), 9, x > 50 ? 255 : 0);
  }
  const fs::path file = folder_ / "colors.tif";
  GeoTiffWriter writer(file, raster_, GeoTiffPixels::kColour);
  for (const cv::Rect& window : {cv::Rect(0, 0, 400, 600), cv::Rect(400, 0, 300, 600)})
    writer.Write(window, pixels(window));
  EXPECT_FALSE(fs::exists(file));
  writer.Commit();
  const GeoTiff read = ReadGeoTiff(file);
  EXPECT_EQ(read.raster.epsg, 32632);
  EXPECT_EQ(read.raster.west, raster_.west);
  EXPECT_EQ(read.raster.north, raster_.north);
  EXPECT_EQ(read.raster.cell, raster_.cell);
  ASSERT_EQ(read.values.size(), pixels.size());
  EXPECT_EQ(cv::norm(read.values, pixels, cv::NORM_INF), 0);
  EXPECT_EQ(FilesInFolder(), 1u);
}

TEST_F(GeoTiffTest, HeightsComeBackWithoutASystem) {
  GeoRaster raster = raster_;
  raster.epsg.reset();
  cv::Mat1f heights(raster.rows, raster.columns, 12.5f);
  heights(3, 4) = std::nanf("");
  const fs::path file = folder_ / "heights.tif";
  GeoTiffWriter writer(file, raster, GeoTiffPixels::kHeight);
  writer.Write({{}, heights.size()}, heights);
  writer.Commit();
  const GeoTiff read = ReadGeoTiff(file);
  EXPECT_FALSE(read.raster.epsg);
  const cv::Mat1f values = read.values;
  EXPECT_TRUE(std::isnan(values(3, 4)));
  EXPECT_EQ(values(4, 3), 12.5f);
}

TEST_F(GeoTiffTest, NothingStaysOfWhatIsNotCommitted) {
  { const GeoTiffWriter writer(folder_ / "left.tif", raster_, GeoTiffPixels::kColour); }
  EXPECT_EQ(FilesInFolder(), 0u);
}

TEST_F(GeoTiffTest, BadInput) {
  const auto write = [&](const fs::path& file, const GeoRaster& raster) {
    const GeoTiffWriter writer(file, raster, GeoTiffPixels::kColour);
  };
  EXPECT_THROW(write(folder_ / "absent/a.tif", raster_), Error);
  EXPECT_THROW(write(folder_, raster_), Error);
  GeoRaster wrong = raster_;
  wrong.columns = 0;
  EXPECT_THROW(write(folder_ / "a.tif", wrong), Error);
  wrong = raster_;
  wrong.epsg = 99999999;
  EXPECT_THROW(write(folder_ / "a.tif", wrong), Error);
  EXPECT_THROW(ReadGeoTiff(folder_ / "none.tif"), Error);
  EXPECT_EQ(FilesInFolder(), 0u);
}

}  // namespace
}  // namespace deepuav
