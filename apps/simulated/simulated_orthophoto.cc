#include "simulated/simulated_orthophoto.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/io/geodata/geotiff_file.h"
#include "deepuav/ortho/ground_frame.h"
#include "deepuav/simulation/rendering/sensor.h"
#include "deepuav/simulation/rendering/view_from_above.h"

namespace deepuav {
namespace {

GroundFrame FrameOf(const GnssOptions& gnss) {
  Gauge gauge;
  gauge.kind = GaugeKind::kGeoreferenced;
  gauge.origin = {gnss.origin_latitude_deg, gnss.origin_longitude_deg, gnss.origin_altitude_m};
  return MakeGroundFrame(gauge, {}, {});
}

/// What the camera sees straight down from all positions.
GeoRaster RasterBelow(const std::vector<Eigen::Vector3d>& positions, const World& world,
                      const Camera& camera, const GroundFrame& frame, double cell_m) {
  const double tangent =
      std::max(camera.width / camera.pinhole.fx, camera.height / camera.pinhole.fy) / 2;
  const Eigen::Vector3d first = frame.ground_from_world(positions.front());
  Eigen::Vector2d low = first.head<2>(), high = low;
  for (const Eigen::Vector3d& position : positions) {
    const double reach = tangent * (position.z() - world.GroundHeight(position.x(), position.y()));
    const Eigen::Vector2d middle = frame.ground_from_world(position).head<2>();
    low = low.cwiseMin((middle.array() - reach).matrix());
    high = high.cwiseMax((middle.array() + reach).matrix());
  }
  const Eigen::Vector2d cells = (high - low) / cell_m;
  constexpr double kMostCells = 4e8;
  if (cells.prod() > kMostCells) {
    throw Error("the orthophoto would have {:.0f} x {:.0f} cells: expected coarser ones", cells.x(),
                cells.y());
  }
  return {.columns = static_cast<int>(std::ceil(cells.x())),
          .rows = static_cast<int>(std::ceil(cells.y())),
          .west = low.x(),
          .north = high.y(),
          .cell = cell_m,
          .epsg = frame.epsg};
}

/// Places of the world, and what is to be added to their heights, for places of the raster: exact
/// at its corners and bilinear between them, which errs by a millimetre over some kilometres.
class WorldBelow {
 public:
  WorldBelow(const GeoRaster& raster, const GroundFrame& frame, double altitude_m)
      : columns_(raster.columns), rows_(raster.rows) {
    for (size_t i = 0; i < corners_.size(); ++i) {
      const Eigen::Vector3d ground(raster.west + (i % 2 == 0 ? 0 : columns_) * raster.cell,
                                   raster.north - (i < 2 ? 0 : rows_) * raster.cell, altitude_m);
      const Eigen::Vector2d place = frame.world_from_ground(ground).head<2>();
      corners_[i] << place, frame.ground_from_world({place.x(), place.y(), 0}).z();
    }
  }

  /// x, y, altitude of height 0.
  Eigen::Vector3d At(double column, double row) const {
    const double u = (column + 0.5) / columns_, v = (row + 0.5) / rows_;
    return (1 - v) * ((1 - u) * corners_[0] + u * corners_[1]) +
           v * ((1 - u) * corners_[2] + u * corners_[3]);
  }

 private:
  double columns_, rows_;
  std::array<Eigen::Vector3d, 4> corners_;
};

/// As a photograph of all of it would be developed.
cv::Mat4b Developed(const cv::Mat1f& radiance, const SensorOptions& sensor) {
  constexpr size_t kSample = 20000;
  std::vector<float> sample;
  const size_t stride = std::max<size_t>(1, radiance.total() / kSample);
  for (size_t i = 0; i < radiance.total(); i += stride) sample.push_back(radiance.ptr<float>()[i]);
  const double scale = MeteredScale(sensor, sample);
  cv::Mat1f level;
  cv::pow(cv::min(scale * radiance, 1.0), 1 / sensor.gamma, level);
  cv::Mat1b grey;
  level.convertTo(grey, CV_8U, 255);
  cv::Mat4b colours;
  cv::cvtColor(grey, colours, cv::COLOR_GRAY2BGRA);
  return colours;
}

void Write(const std::filesystem::path& file, const GeoRaster& raster, GeoTiffPixels pixels,
           const cv::Mat& values) {
  GeoTiffWriter writer(file, raster, pixels);
  writer.Write({{}, values.size()}, values);
  writer.Commit();
}

}  // namespace

void WriteTrueOrthophoto(const std::filesystem::path& folder, const World& world,
                         const SimulationOptions& options,
                         const std::vector<Eigen::Vector3d>& positions, double cell_m,
                         int threads) {
  if (positions.empty()) throw Error("{}: no image is below which to look", folder.string());
  const GroundFrame frame = FrameOf(options.gnss);
  const GeoRaster raster = RasterBelow(positions, world, MakeCamera(options), frame, cell_m);
  RenderOptions render;
  render.sensor = options.sensor;
  render.weather = options.weather;
  render.threads = threads;
  const WorldBelow below(raster, frame, options.gnss.origin_altitude_m);
  const auto place_of = [&](double column, double row) -> Eigen::Vector2d {
    return below.At(column, row).head<2>();
  };
  ViewFromAbove view = LookDown(world, render, {raster.columns, raster.rows}, cell_m, place_of);
  Write(folder / "orthophoto.tif", raster, GeoTiffPixels::kColour,
        Developed(view.radiance, options.sensor));
  for (int row = 0; row < raster.rows; ++row) {
    for (int column = 0; column < raster.columns; ++column)
      view.height_m(row, column) += static_cast<float>(below.At(column, row).z());
  }
  Write(folder / "dsm.tif", raster, GeoTiffPixels::kHeight, view.height_m);
}

}  // namespace deepuav
