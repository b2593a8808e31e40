#include "deepuav/io/geodata/geotiff_file.h"

#include <cpl_error.h>
#include <cpl_string.h>
#include <gdal.h>
#include <gdal_frmts.h>
#include <ogr_srs_api.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/io/files/temporary_files.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

// GDAL counts bands from 1; a raster in memory is blue, green, red, alpha.
constexpr std::array<int, 4> kBandsOfColours = {3, 2, 1, 4};
constexpr int kOneBand = 1, kColourBands = 4;
constexpr int kSmallestOverview = 256;

/// What GDAL says of a failure is kept for the Error's text instead of being printed.
class QuietGdal {
 public:
  QuietGdal() {
    CPLPushErrorHandler(CPLQuietErrorHandler);
    CPLErrorReset();
  }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
};

/// Of the many formats only this one, so that no plug-in is loaded.
GDALDriverH GeoTiffDriver() {
  static const bool registered = [] {
    GDALRegister_GTiff();
    // Else a twentieth of the machine's memory.
    constexpr GIntBig kCacheBytes = GIntBig{64} << 20;
    GDALSetCacheMax64(kCacheBytes);
    return true;
  }();
  return registered ? GDALGetDriverByName("GTiff") : nullptr;
}

fs::path TemporaryBeside(const fs::path& file) {
  static std::atomic<unsigned> count{0};
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  return folder / fmt::format(".deepuav-{}-{}.tif.tmp", ::getpid(), count.fetch_add(1));
}

CPLErr Transfer(GDALDatasetH dataset, GDALRWFlag direction, const cv::Rect& window,
                cv::Mat* values) {
  const bool is_colour = values->channels() == kColourBands;
  std::array<int, kColourBands> bands = kBandsOfColours;
  if (!is_colour) bands[0] = kOneBand;
  return GDALDatasetRasterIOEx(
      dataset, direction, window.x, window.y, window.width, window.height, values->data,
      values->cols, values->rows, is_colour ? GDT_Byte : GDT_Float32,
      is_colour ? kColourBands : kOneBand, bands.data(), static_cast<GSpacing>(values->elemSize()),
      static_cast<GSpacing>(values->step[0]), static_cast<GSpacing>(values->elemSize1()), nullptr);
}

}  // namespace

GeoTiffWriter::GeoTiffWriter(const fs::path& file, const GeoRaster& raster, GeoTiffPixels pixels)
    : file_(file),
      temporary_(TemporaryBeside(file)),
      pixels_(pixels),
      size_(raster.columns, raster.rows) {
  if (raster.columns < 1 || raster.rows < 1 || !(raster.cell > 0)) {
    throw Error("{}: {} x {} cells of {}: expected a raster", file.string(), raster.columns,
                raster.rows, raster.cell);
  }
  if (fs::is_directory(file)) throw Error("{}: cannot be written: it is a folder", file.string());
  const QuietGdal quiet;
  RememberTemporaryFile(temporary_);
  try {
    Create(raster);
    Place(raster);
  } catch (...) {
    Close();
    throw;
  }
}

GeoTiffWriter::~GeoTiffWriter() { Close(); }

void GeoTiffWriter::Close() noexcept {
  if (temporary_.empty()) return;
  const QuietGdal quiet;
  if (dataset_) GDALClose(dataset_);
  dataset_ = nullptr;
  ::unlink(temporary_.c_str());
  ForgetTemporaryFile(temporary_);
  temporary_.clear();
}

void GeoTiffWriter::Fail(const std::string& what) const {
  throw Error("{}: {}: {}", file_.string(), what, CPLGetLastErrorMsg());
}

void GeoTiffWriter::Create(const GeoRaster& raster) {
  const bool is_colour = pixels_ == GeoTiffPixels::kColour;
  CPLStringList options;
  for (const char* option : {"TILED=YES", "COMPRESS=DEFLATE", "BIGTIFF=IF_SAFER"})
    options.AddString(option);
  // Differences of neighbours; of floats byte by byte.
  options.AddString(is_colour ? "PREDICTOR=2" : "PREDICTOR=3");
  if (is_colour) {
    options.AddString("PHOTOMETRIC=RGB");
    options.AddString("ALPHA=YES");
  }
  GDALDriverH driver = GeoTiffDriver();
  if (!driver) Fail("GDAL has no GeoTIFF");
  dataset_ = GDALCreate(driver, temporary_.c_str(), raster.columns, raster.rows,
                        is_colour ? kColourBands : kOneBand, is_colour ? GDT_Byte : GDT_Float32,
                        options.List());
  if (!dataset_) Fail("cannot be created");
  if (!is_colour) GDALSetRasterNoDataValue(GDALGetRasterBand(dataset_, kOneBand), kNoHeight);
}

void GeoTiffWriter::Place(const GeoRaster& raster) {
  std::array<double, 6> transform = {raster.west, raster.cell, 0, raster.north, 0, -raster.cell};
  if (GDALSetGeoTransform(dataset_, transform.data()) != CE_None) Fail("cannot be placed");
  if (!raster.epsg) return;
  OGRSpatialReferenceH system = OSRNewSpatialReference(nullptr);
  const bool is_known = OSRImportFromEPSG(system, *raster.epsg) == OGRERR_NONE &&
                        GDALSetSpatialRef(dataset_, system) == CE_None;
  OSRDestroySpatialReference(system);
  if (!is_known) Fail(fmt::format("EPSG:{} is not known", *raster.epsg));
}

void GeoTiffWriter::Write(const cv::Rect& window, const cv::Mat& values) {
  const QuietGdal quiet;
  cv::Mat copy = values;
  if (pixels_ == GeoTiffPixels::kHeight) {
    copy = values.clone();
    cv::patchNaNs(copy, kNoHeight);
  }
  if (Transfer(dataset_, GF_Write, window, &copy) != CE_None) Fail("cannot be written");
}

void GeoTiffWriter::BuildOverviews() {
  std::vector<int> factors;
  for (int factor = 2; std::max(size_.width, size_.height) / factor >= kSmallestOverview;
       factor *= 2)
    factors.push_back(factor);
  if (factors.empty()) return;
  if (GDALBuildOverviews(dataset_, "AVERAGE", static_cast<int>(factors.size()), factors.data(), 0,
                         nullptr, nullptr, nullptr) != CE_None)
    Fail("overviews cannot be written");
}

void GeoTiffWriter::Commit() {
  const QuietGdal quiet;
  BuildOverviews();
  // What is still to be written is told by an error alone: closing returns nothing.
  CPLErrorReset();
  GDALClose(dataset_);
  dataset_ = nullptr;
  if (CPLGetLastErrorType() >= CE_Failure) Fail("cannot be written");
  std::error_code error;
  fs::rename(temporary_, file_, error);
  if (error) throw Error("{}: cannot be written: {}", file_.string(), error.message());
  ForgetTemporaryFile(temporary_);
  temporary_.clear();
}

GeoTiff ReadGeoTiff(const fs::path& file) {
  const QuietGdal quiet;
  GeoTiffDriver();
  GDALDatasetH dataset = GDALOpen(file.c_str(), GA_ReadOnly);
  if (!dataset)
    throw Error("{}: is no GeoTIFF that can be read: {}", file.string(), CPLGetLastErrorMsg());
  GeoTiff tiff;
  std::array<double, 6> transform{};
  GDALGetGeoTransform(dataset, transform.data());
  tiff.raster = {.columns = GDALGetRasterXSize(dataset),
                 .rows = GDALGetRasterYSize(dataset),
                 .west = transform[0],
                 .north = transform[3],
                 .cell = transform[1],
                 .epsg = {}};
  if (OGRSpatialReferenceH system = GDALGetSpatialRef(dataset)) {
    if (const char* code = OSRGetAuthorityCode(system, nullptr)) tiff.raster.epsg = std::stoi(code);
  }
  const int bands = GDALGetRasterCount(dataset);
  const bool is_known = bands == kColourBands || bands == kOneBand;
  CPLErr failed = CE_None;
  if (is_known) {
    tiff.values.create(tiff.raster.rows, tiff.raster.columns,
                       bands == kColourBands ? CV_8UC4 : CV_32FC1);
    failed = Transfer(dataset, GF_Read, {{}, tiff.values.size()}, &tiff.values);
  }
  GDALClose(dataset);
  if (!is_known) throw Error("{}: has {} bands: expected 1 or 4", file.string(), bands);
  if (failed != CE_None) throw Error("{}: cannot be read: {}", file.string(), CPLGetLastErrorMsg());
  if (bands == kOneBand) {
    const float none = std::nanf("");
    tiff.values.setTo(none, tiff.values == GeoTiffWriter::kNoHeight);
  }
  return tiff;
}

}  // namespace deepuav
