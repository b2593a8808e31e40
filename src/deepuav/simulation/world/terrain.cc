#include "deepuav/simulation/world/terrain.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/simulation/world/filtered_patterns.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

constexpr double kReachM = 5000;  // Of the mirrored land beyond the border.
constexpr double kCellGrowth = 1.12;
constexpr float kBedM = -1.6f;  // Of rivers and lakes.
constexpr float kDryM = 0.7f;   // The least height of land.
constexpr float kCausewayM = 1.6f;

class Relief {
 public:
  explicit Relief(const SceneOptions& options) : options_(options) {}

  float Height(float x, float y) const {
    const auto length = static_cast<float>(options_.relief_length_m);
    const auto relief = static_cast<float>(options_.relief_m);
    const float hills = FractalNoise(x / length, y / length, 0, 6, 0.38f, seed_);
    const auto town = static_cast<float>(options_.town_radius_m);
    const float flat = town > 0 ? SmoothStep(0.8f * town, 1.6f * town, std::hypot(x, y)) : 1;
    return 0.35f * relief + 2 + relief * (0.3f + 0.7f * flat) * hills + Dunes(x, y, flat);
  }

 private:
  float Dunes(float x, float y, float flat) const {
    if (options_.aridity <= 0) return 0;
    const float ridge = 1 - std::abs(GradientNoise(x / 90, y / 140, 0, seed_ + 99));
    const float where = SmoothStep(-0.2f, 0.4f, GradientNoise(x / 300, y / 300, 0, seed_ + 98));
    return static_cast<float>(options_.aridity) * flat * where * 7 * ridge * ridge;
  }

  const SceneOptions& options_;
  uint32_t seed_ = HashCell(options_.seed, 4, 0x7e44a1u);
};

float Mirror(float x, float half) {
  const float period = 4 * half;
  float t = std::fmod(x + half, period);
  if (t < 0) t += period;
  return (t > 2 * half ? period - t : t) - half;
}

}  // namespace

Terrain::Terrain(const SceneOptions& options, const Water& water, const RoadNetwork& roads)
    : half_extent_(options.extent_m / 2) {
  const int cells =
      std::max(2, static_cast<int>(std::lround(options.extent_m / options.terrain_cell_m)));
  cell_ = options.extent_m / cells;
  side_ = cells + 1;
  heights_.resize(static_cast<size_t>(side_) * side_);
  if (options.dem.empty()) {
    FillProcedural(options, water, roads);
  } else {
    FillFromImage(options);
  }
  ComputeNormals();
}

void Terrain::FillProcedural(const SceneOptions& options, const Water& water,
                             const RoadNetwork& roads) {
  const Relief relief(options);
  for (int j = 0; j < side_; ++j) {
    for (int i = 0; i < side_; ++i) {
      const auto x = static_cast<float>(i * cell_ - half_extent_);
      const auto y = static_cast<float>(j * cell_ - half_extent_);
      const float shore = water.ShoreDistance(x, y);
      float height = std::max(relief.Height(x, y), kDryM);
      height = Mix(kDryM, height, SmoothStep(2, 60, shore));
      height = Mix(kBedM, height, SmoothStep(-5, 2, shore));
      const RoadNetwork::Place road = roads.Find(x, y);
      if (road.road != nullptr) {
        const float bank = kCausewayM * (1 - SmoothStep(1, RoadNetwork::kVergeM, road.edge_m));
        height = std::max(height, bank);
      }
      HeightAt(i, j) = height;
    }
  }
}

void Terrain::FillFromImage(const SceneOptions& options) {
  RefuseNamedPipe(options.dem);
  const cv::Mat image = cv::imread(options.dem, cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE);
  if (image.empty()) throw Error("{}: cannot be read as an image of heights", options.dem);
  cv::Mat1f dem;
  image.convertTo(dem, CV_32F, options.dem_unit_m);
  if (!cv::checkRange(dem)) throw Error("{}: has heights that are not finite", options.dem);
  const double lowest = *std::min_element(dem.begin(), dem.end());
  for (int j = 0; j < side_; ++j) {
    for (int i = 0; i < side_; ++i) {
      // Image rows run from north to south.
      const double u = (i * cell_ - half_extent_) / options.dem_cell_m + (dem.cols - 1) / 2.0;
      const double v = (half_extent_ - j * cell_) / options.dem_cell_m + (dem.rows - 1) / 2.0;
      const double uc = std::clamp(u, 0.0, dem.cols - 1.0), vc = std::clamp(v, 0.0, dem.rows - 1.0);
      const int u0 = std::min(static_cast<int>(uc), std::max(0, dem.cols - 2));
      const int v0 = std::min(static_cast<int>(vc), std::max(0, dem.rows - 2));
      const int u1 = std::min(u0 + 1, dem.cols - 1), v1 = std::min(v0 + 1, dem.rows - 1);
      const double fu = uc - u0, fv = vc - v0;
      HeightAt(i, j) = (1 - fv) * ((1 - fu) * dem(v0, u0) + fu * dem(v0, u1)) +
                       fv * ((1 - fu) * dem(v1, u0) + fu * dem(v1, u1)) - lowest + kDryM;
    }
  }
}

void Terrain::ComputeNormals() {
  normals_.resize(heights_.size());
  for (int j = 0; j < side_; ++j) {
    for (int i = 0; i < side_; ++i) {
      const int west = std::max(i - 1, 0), east = std::min(i + 1, side_ - 1);
      const int south = std::max(j - 1, 0), north = std::min(j + 1, side_ - 1);
      const double dx = (HeightAt(east, j) - HeightAt(west, j)) / ((east - west) * cell_);
      const double dy = (HeightAt(i, north) - HeightAt(i, south)) / ((north - south) * cell_);
      normals_[static_cast<size_t>(j) * side_ + i] =
          Eigen::Vector3d(-dx, -dy, 1).normalized().cast<float>();
    }
  }
}

double Terrain::Height(double x, double y) const {
  const double u = std::clamp((x + half_extent_) / cell_, 0.0, side_ - 1.0);
  const double v = std::clamp((y + half_extent_) / cell_, 0.0, side_ - 1.0);
  const int i = std::min(static_cast<int>(u), side_ - 2),
            j = std::min(static_cast<int>(v), side_ - 2);
  const double fu = u - i, fv = v - j;
  const double sw = HeightAt(i, j), ne = HeightAt(i + 1, j + 1);
  // The diagonal of MakeMesh runs from south-west to north-east.
  if (fu >= fv) {
    const double se = HeightAt(i + 1, j);
    return sw + fu * (se - sw) + fv * (ne - se);
  }
  const double nw = HeightAt(i, j + 1);
  return sw + fv * (nw - sw) + fu * (ne - nw);
}

Eigen::Vector3f Terrain::Normal(float x, float y) const {
  const auto last = static_cast<float>(side_ - 1);
  const float u =
      std::clamp((x + static_cast<float>(half_extent_)) / static_cast<float>(cell_), 0.0f, last);
  const float v =
      std::clamp((y + static_cast<float>(half_extent_)) / static_cast<float>(cell_), 0.0f, last);
  const int i = std::min(static_cast<int>(u), side_ - 2),
            j = std::min(static_cast<int>(v), side_ - 2);
  const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
  const Eigen::Vector3f* row = normals_.data() + static_cast<size_t>(j) * side_ + i;
  const Eigen::Vector3f south = (1 - fu) * row[0] + fu * row[1];
  const Eigen::Vector3f north = (1 - fu) * row[side_] + fu * row[side_ + 1];
  return ((1 - fv) * south + fv * north).normalized();
}

Eigen::Vector2f Terrain::Mirrored(float x, float y) const {
  const auto half = static_cast<float>(half_extent_);
  if (std::abs(x) <= half && std::abs(y) <= half) return {x, y};
  return {Mirror(x, half), Mirror(y, half)};
}

Terrain::Mesh Terrain::MakeMesh() const {
  std::vector<double> lines;
  std::vector<double> outside;
  double step = cell_;
  for (double at = half_extent_; at < half_extent_ + kReachM;) {
    step *= kCellGrowth;
    at += step;
    outside.push_back(at);
  }
  for (auto at = outside.rbegin(); at != outside.rend(); ++at) lines.push_back(-*at);
  for (int i = 0; i < side_; ++i) lines.push_back(i * cell_ - half_extent_);
  lines.insert(lines.end(), outside.begin(), outside.end());

  Mesh mesh;
  const auto count = static_cast<uint32_t>(lines.size());
  for (const double y : lines) {
    for (const double x : lines) {
      const Eigen::Vector2f inside = Mirrored(static_cast<float>(x), static_cast<float>(y));
      mesh.vertices.emplace_back(static_cast<float>(x), static_cast<float>(y),
                                 static_cast<float>(Height(inside.x(), inside.y())));
    }
  }
  for (uint32_t j = 0; j + 1 < count; ++j) {
    for (uint32_t i = 0; i + 1 < count; ++i) {
      const uint32_t sw = j * count + i, se = sw + 1, nw = sw + count, ne = nw + 1;
      mesh.triangles.emplace_back(sw, se, ne);
      mesh.triangles.emplace_back(sw, ne, nw);
    }
  }
  return mesh;
}

}  // namespace deepuav
