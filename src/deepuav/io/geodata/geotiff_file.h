#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace deepuav {

/// Where the cells of a raster lie: square, the first row in the north.
struct GeoRaster {
  int columns = 0, rows = 0;
  double west = 0, north = 0;  ///< Outer edges of the first column and row.
  double cell = 0;             ///< Width of a cell, as `west`: metres in a system of `epsg`.
  std::optional<int> epsg;     ///< A projected system; nothing: the file names none.
};

enum class GeoTiffPixels {
  kColour,  ///< cv::Vec4b: blue, green, red and alpha.
  kHeight,  ///< float; NaN where nothing is known, written as kNoHeight, the file's nodata.
};

/// Writes a tiled, compressed GeoTIFF with overviews window by window, so that no raster need fit
/// into memory. The file appears under its name when it is complete, by Commit(). Every member
/// throws Error naming the file and the reason.
class GeoTiffWriter {
 public:
  static constexpr float kNoHeight = -9999;

  GeoTiffWriter(const std::filesystem::path& file, const GeoRaster& raster, GeoTiffPixels pixels);
  ~GeoTiffWriter();
  GeoTiffWriter(const GeoTiffWriter&) = delete;
  GeoTiffWriter& operator=(const GeoTiffWriter&) = delete;

  /// `window`: the columns and rows that `values` (CV_8UC4 or CV_32FC1) has.
  void Write(const cv::Rect& window, const cv::Mat& values);
  /// Nothing may be written afterwards.
  void Commit();

 private:
  void Create(const GeoRaster& raster);
  void Place(const GeoRaster& raster);
  void BuildOverviews();
  void Close() noexcept;
  [[noreturn]] void Fail(const std::string& what) const;

  std::filesystem::path file_, temporary_;
  GeoTiffPixels pixels_;
  void* dataset_ = nullptr;  ///< GDAL's.
  cv::Size size_;
};

/// A GeoTIFF whole in memory.
struct GeoTiff {
  GeoRaster raster;
  cv::Mat values;  ///< As GeoTiffWriter takes them.
};

/// Reads what GeoTiffWriter wrote. Throws Error naming the file for another.
GeoTiff ReadGeoTiff(const std::filesystem::path& file);

}  // namespace deepuav
