// How far an orthophoto and a DSM lie from the truth that `deepuav simulate --orthophoto` writes:
//
//   orthophoto_error MAP.deepuav ORTHOPHOTO.tif DSM.tif TRUE_ORTHOPHOTO.tif TRUE_DSM.tif
//
// Patches of 48 by 48 cells are found in the truth by normalised correlation, to a tenth of a cell.
// Prints as JSON: how many were found, the median and 90th percentile of their displacements in
// cells, the same after a shift of the whole (what the georeference is off), the share of cells
// without a colour among those that at least three of the map's photographs show (by the true
// heights and the map's own poses), and the median error of the DSM in metres.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/base/median.h"
#include "deepuav/io/geodata/geotiff_file.h"
#include "deepuav/ortho/map_scene.h"

namespace deepuav {
namespace {

constexpr int kPatch = 48, kReach = 16;
constexpr double kLeastCorrelation = 0.6;

Eigen::Vector2d PlaceOf(const GeoRaster& raster, double column, double row) {
  return {raster.west + (column + 0.5) * raster.cell, raster.north - (row + 0.5) * raster.cell};
}

/// `other` in the cells of `raster`.
cv::Mat InCellsOf(const GeoRaster& raster, const GeoTiff& other, int interpolation) {
  const double scale = raster.cell / other.raster.cell;
  const double x = (raster.west - other.raster.west) / other.raster.cell;
  const double y = (other.raster.north - raster.north) / other.raster.cell;
  // Of the middles of cells.
  const cv::Matx23d to_other(scale, 0, x + scale / 2 - 0.5, 0, scale, y + scale / 2 - 0.5);
  cv::Mat moved;
  cv::warpAffine(other.values, moved, to_other, {raster.columns, raster.rows},
                 interpolation | cv::WARP_INVERSE_MAP, cv::BORDER_CONSTANT,
                 other.values.type() == CV_32F ? cv::Scalar(std::nan("")) : cv::Scalar());
  return moved;
}

cv::Mat1b Channel(const cv::Mat& colours, int channel) {
  cv::Mat1b one;
  cv::extractChannel(colours, one, channel);
  return one;
}

/// The vertex of the parabola through three values about the largest.
double Vertex(float before, float at, float after) {
  const double bend = static_cast<double>(before + after - 2 * at);
  return bend < 0 ? 0.5 * static_cast<double>(before - after) / bend : 0;
}

/// Where the truth has the patch at `corner`, less where the orthophoto has it; nothing where
/// either is not whole or too little like the other.
std::optional<Eigen::Vector2d> Displacement(const cv::Mat1b& made, const cv::Mat1b& truth,
                                            const cv::Point& corner) {
  const cv::Rect searched(corner.x - kReach, corner.y - kReach, kPatch + 2 * kReach,
                          kPatch + 2 * kReach);
  cv::Mat1f score;
  cv::matchTemplate(truth(searched), made(cv::Rect(corner, cv::Size(kPatch, kPatch))), score,
                    cv::TM_CCOEFF_NORMED);
  double best = 0;
  cv::Point at;
  cv::minMaxLoc(score, nullptr, &best, nullptr, &at);
  const bool is_at_edge =
      at.x == 0 || at.y == 0 || at.x == score.cols - 1 || at.y == score.rows - 1;
  if (best < kLeastCorrelation || is_at_edge) return std::nullopt;
  const Eigen::Vector2d part(Vertex(score(at.y, at.x - 1), score(at), score(at.y, at.x + 1)),
                             Vertex(score(at.y - 1, at.x), score(at), score(at.y + 1, at.x)));
  return Eigen::Vector2d(at.x - kReach, at.y - kReach) + part;
}

struct Displacements {
  std::vector<Eigen::Vector2d> found;
  int tried = 0;
};

Displacements FindAll(const cv::Mat& made, const cv::Mat& truth) {
  const cv::Mat1b grey = Channel(made, 1), alpha = Channel(made, 3);
  const cv::Mat1b true_grey = Channel(truth, 1), true_alpha = Channel(truth, 3);
  Displacements all;
  for (int y = kReach; y + kPatch + kReach <= grey.rows; y += kPatch) {
    for (int x = kReach; x + kPatch + kReach <= grey.cols; x += kPatch) {
      const cv::Rect searched(x - kReach, y - kReach, kPatch + 2 * kReach, kPatch + 2 * kReach);
      if (cv::countNonZero(alpha(searched)) < searched.area() ||
          cv::countNonZero(true_alpha(searched)) < searched.area())
        continue;
      ++all.tried;
      if (const auto found = Displacement(grey, true_grey, {x, y})) all.found.push_back(*found);
    }
  }
  if (all.found.empty()) throw Error("no patch of the orthophoto is found in the truth");
  return all;
}

double Percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
}

std::vector<double> Lengths(const std::vector<Eigen::Vector2d>& moves,
                            const Eigen::Vector2d& less) {
  std::vector<double> lengths;
  for (const Eigen::Vector2d& move : moves) lengths.push_back((move - less).norm());
  return lengths;
}

Eigen::Vector2d MedianMove(const std::vector<Eigen::Vector2d>& moves) {
  std::vector<double> x, y;
  for (const Eigen::Vector2d& move : moves) x.push_back(move.x()), y.push_back(move.y());
  return {Median(x), Median(y)};
}

struct Holes {
  int64_t seen = 0;   ///< By three photographs.
  int64_t holes = 0;  ///< Of these.
};

Holes CountHoles(const MapScene& map, const GeoTiff& ortho, const cv::Mat1f& true_heights) {
  constexpr int kEvery = 4, kViews = 3;
  const Camera& camera = map.scene.camera;
  const cv::Mat1b alpha = Channel(ortho.values, 3);
  Holes holes;
  for (int row = 0; row < alpha.rows; row += kEvery) {
    for (int column = 0; column < alpha.cols; column += kEvery) {
      const auto height = static_cast<double>(true_heights(row, column));
      if (std::isnan(height)) continue;
      const Eigen::Vector2d place = PlaceOf(ortho.raster, column, row);
      const Eigen::Vector3d world =
          map.scene.frame.world_from_ground({place.x(), place.y(), height});
      int views = 0;
      for (const OrthoView& view : map.scene.views) {
        const auto seen = Look(camera, view, world);
        views += seen && seen->px.x() >= 0 && seen->px.y() >= 0 &&
                 seen->px.x() <= camera.width - 1 && seen->px.y() <= camera.height - 1;
      }
      if (views < kViews) continue;
      ++holes.seen;
      if (alpha(row, column) == 0) ++holes.holes;
    }
  }
  return holes;
}

double MedianHeightError(const cv::Mat1f& made, const cv::Mat1f& truth) {
  std::vector<double> errors;
  for (int row = 0; row < made.rows; ++row) {
    for (int column = 0; column < made.cols; ++column) {
      const float error = std::abs(made(row, column) - truth(row, column));
      if (!std::isnan(error)) errors.push_back(static_cast<double>(error));
    }
  }
  if (errors.empty()) throw Error("the DSM and the truth do not overlap");
  return Median(errors);
}

void Run(char** files) {
  const LoadedAtlas loaded = ReadMapFile(files[0]);
  const MapScene map = SceneOf(loaded, loaded.atlas.Remaining().front());
  const GeoTiff ortho = ReadGeoTiff(files[1]), dsm = ReadGeoTiff(files[2]);
  const GeoTiff true_ortho = ReadGeoTiff(files[3]), true_dsm = ReadGeoTiff(files[4]);
  const Displacements all =
      FindAll(ortho.values, InCellsOf(ortho.raster, true_ortho, cv::INTER_LINEAR));
  const std::vector<double> lengths = Lengths(all.found, Eigen::Vector2d::Zero());
  const Eigen::Vector2d shift = MedianMove(all.found);
  const std::vector<double> shifted = Lengths(all.found, shift);
  const Holes holes = CountHoles(map, ortho, InCellsOf(ortho.raster, true_dsm, cv::INTER_NEAREST));
  const double height_m =
      MedianHeightError(dsm.values, InCellsOf(dsm.raster, true_dsm, cv::INTER_NEAREST));
  std::cout << fmt::format(
      "{{\"patches\": {}, \"found\": {}, \"cell_m\": {:.4f}, \"median_px\": {:.2f}, "
      "\"p90_px\": {:.2f}, \"shift_px\": [{:.2f}, {:.2f}], \"median_less_shift_px\": {:.2f}, "
      "\"p90_less_shift_px\": {:.2f}, \"seen_by_three\": {}, \"holes\": {}, "
      "\"median_height_error_m\": {:.3f}}}\n",
      all.tried, all.found.size(), ortho.raster.cell, Percentile(lengths, 0.5),
      Percentile(lengths, 0.9), shift.x(), shift.y(), Percentile(shifted, 0.5),
      Percentile(shifted, 0.9), holes.seen, holes.holes, height_m);
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  constexpr int kFiles = 5;
  if (argc != 1 + kFiles) {
    std::cerr << "orthophoto_error MAP ORTHOPHOTO DSM TRUE_ORTHOPHOTO TRUE_DSM\n";
    return 2;
  }
  return deepuav::RunBench("orthophoto_error", [&] {
    deepuav::Run(argv + 1);
    return 0;
  });
}
