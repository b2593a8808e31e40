#include "deepuav/ortho/surface.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/flann.hpp>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"
#include "deepuav/ortho/gap_filling.h"

namespace deepuav {
namespace {

using Points = std::vector<Eigen::Vector3f>;

constexpr float kDeviationOfMad = 1.4826f;  // of a normal distribution

/// The nearest points of each place of a plane.
class Neighbourhood {
 public:
  explicit Neighbourhood(const Points& points) : places_(static_cast<int>(points.size()), 2) {
    for (size_t i = 0; i < points.size(); ++i) {
      const int row = static_cast<int>(i);
      places_(row, 0) = points[i].x();
      places_(row, 1) = points[i].y();
    }
    index_ = cv::makePtr<Index>(places_, cvflann::KDTreeSingleIndexParams());
  }

  int size() const { return places_.rows; }

  /// Writes the indices of the nearest `count` and their distances, nearest first.
  void Find(float x, float y, int count, std::vector<int>* indices, std::vector<float>* distances) {
    std::vector<float> query = {x, y};
    indices->resize(static_cast<size_t>(count));
    distances->resize(static_cast<size_t>(count));
    index_->knnSearch(query, *indices, *distances, count, cvflann::SearchParams(-1));
    for (float& distance : *distances) distance = std::sqrt(distance);
  }

 private:
  using Index = cv::flann::GenericIndex<cvflann::L2_Simple<float>>;
  cv::Mat1f places_;
  cv::Ptr<Index> index_;
};

/// The middle of the landmarks, and how far their middle 98 % lie from it.
struct Extent {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
};

Extent ExtentOf(const std::vector<Eigen::Vector3d>& landmarks) {
  constexpr double kCut = 0.01;
  Extent extent;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(landmarks.size());
    for (const Eigen::Vector3d& landmark : landmarks) values.push_back(landmark[axis]);
    std::sort(values.begin(), values.end());
    const auto last = static_cast<double>(values.size() - 1);
    const double low = values[static_cast<size_t>(kCut * last)];
    const double high = values[static_cast<size_t>((1 - kCut) * last)];
    extent.middle[axis] = (low + high) / 2;
    if (axis < 2) extent.half[axis] = (high - low) / 2;
  }
  return extent;
}

/// About the middle, without what lies far outside: floats hold these.
Points NearPoints(const std::vector<Eigen::Vector3d>& landmarks, const Extent& extent) {
  constexpr double kReach = 1.5;
  Points points;
  points.reserve(landmarks.size());
  for (const Eigen::Vector3d& landmark : landmarks) {
    const Eigen::Vector3d off = landmark - extent.middle;
    if ((off.head<2>().cwiseAbs().array() <= kReach * extent.half.array()).all())
      points.push_back(off.cast<float>());
  }
  return points;
}

/// What would be the side of the square that a landmark has for itself.
float SpacingOf(float distance, int count) {
  return distance * std::sqrt(static_cast<float>(M_PI) / static_cast<float>(count));
}

/// The points that agree with their neighbours.
Points WithoutOutliers(const Points& points, const SurfaceOptions& options, float* spacing) {
  Neighbourhood neighbourhood(points);
  const int count = std::min(options.neighbours + 1, neighbourhood.size());
  std::vector<int> indices;
  std::vector<float> distances, spacings, offs, scales;
  for (const Eigen::Vector3f& point : points) {
    neighbourhood.Find(point.x(), point.y(), count, &indices, &distances);
    spacings.push_back(SpacingOf(distances.back(), count));
    std::vector<float> heights;
    for (size_t i = 1; i < indices.size(); ++i)
      heights.push_back(points[static_cast<size_t>(indices[i])].z());
    const float middle = Median(heights);
    for (float& height : heights) height = std::abs(height - middle);
    offs.push_back(std::abs(point.z() - middle));
    scales.push_back(kDeviationOfMad * Median(heights));
  }
  *spacing = Median(spacings);
  // On flat ground the neighbours' deviation is that of their noise alone.
  const float least = Median(scales);
  Points kept;
  for (size_t i = 0; i < points.size(); ++i) {
    const bool is_alone = spacings[i] > static_cast<float>(options.max_isolation) * *spacing;
    const bool is_off = offs[i] > static_cast<float>(options.max_off) * std::max(scales[i], least);
    if (!is_alone && !is_off) kept.push_back(points[i]);
  }
  return kept;
}

GroundGrid GridOver(const Points& points, float spacing, double unit,
                    const SurfaceOptions& options) {
  cv::Point2f low(points.front().x(), points.front().y()), high = low;
  for (const Eigen::Vector3f& point : points) {
    low = {std::min(low.x, point.x()), std::min(low.y, point.y())};
    high = {std::max(high.x, point.x()), std::max(high.y, point.y())};
  }
  const double margin = options.margin_spacings * static_cast<double>(spacing);
  const double width = static_cast<double>(high.x - low.x) + 2 * margin;
  const double height = static_cast<double>(high.y - low.y) + 2 * margin;
  GroundGrid grid;
  grid.step = std::max(options.step_over_spacing * static_cast<double>(spacing),
                       std::sqrt(width * height / options.max_nodes));
  if (unit > 0) grid.step = unit * std::max(1.0, std::round(grid.step / unit));
  grid.west = static_cast<double>(low.x) - margin;
  grid.north = static_cast<double>(high.y) + margin;
  grid.columns = 1 + static_cast<int>(std::ceil(width / grid.step));
  grid.rows = 1 + static_cast<int>(std::ceil(height / grid.step));
  return grid;
}

/// The height at (x, y) of a plane through the points, the nearer ones and those that agree
/// counting more; between the lowest and the highest of them.
float HeightThrough(const Points& points, const std::vector<int>& indices,
                    const std::vector<float>& distances, float x, float y) {
  constexpr int kRounds = 4;
  constexpr float kTukey = 4.685f, kSlopeRidge = 0.02f, kHalf = 0.5f;
  const float reach = std::max(kHalf * distances.back(), std::numeric_limits<float>::min());
  const size_t count = indices.size();
  std::vector<float> weights(count), offs(count);
  for (size_t i = 0; i < count; ++i) {
    const float ratio = distances[i] / reach;
    weights[i] = std::exp(-kHalf * ratio * ratio);
  }
  const auto at = [&](size_t i) {
    const Eigen::Vector3f& point = points[static_cast<size_t>(indices[i])];
    return Eigen::Vector3f((point.x() - x) / reach, (point.y() - y) / reach, 1);
  };
  std::vector<float> robust(count, 1), heights(count);
  for (size_t i = 0; i < count; ++i) heights[i] = points[static_cast<size_t>(indices[i])].z();
  const float middle = Median(heights);
  Eigen::Vector3f plane(0, 0, middle);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3f normal = Eigen::Vector3f(kSlopeRidge, kSlopeRidge, 1e-6f).asDiagonal();
    Eigen::Vector3f right(0, 0, 1e-6f * middle);
    for (size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f row = at(i);
      normal += weights[i] * robust[i] * row * row.transpose();
      right += weights[i] * robust[i] * heights[i] * row;
    }
    plane = normal.ldlt().solve(right);
    for (size_t i = 0; i < count; ++i) offs[i] = std::abs(heights[i] - plane.dot(at(i)));
    const float scale = kTukey * kDeviationOfMad * Median(offs);
    for (size_t i = 0; i < count; ++i) {
      const float ratio = scale > 0 ? offs[i] / scale : 0;
      robust[i] = ratio < 1 ? (1 - ratio * ratio) * (1 - ratio * ratio) : 0;
    }
  }
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  return std::clamp(plane.z(), *low, *high);
}

/// Heights at the nodes that landmarks are near to; NaN at others.
cv::Mat1f HeightsNearLandmarks(const Points& points, const GroundGrid& grid, float spacing,
                               const SurfaceOptions& options) {
  Neighbourhood neighbourhood(points);
  const int count = std::min(options.support, neighbourhood.size());
  const float reach = static_cast<float>(options.support_spacings) * spacing;
  cv::Mat1f heights(grid.rows, grid.columns, std::numeric_limits<float>::quiet_NaN());
  cv::parallel_for_({0, grid.rows}, [&](const cv::Range& rows) {
    std::vector<int> indices;
    std::vector<float> distances;
    for (int row = rows.start; row < rows.end; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Eigen::Vector2f place = grid.At(column, row).cast<float>();
        neighbourhood.Find(place.x(), place.y(), count, &indices, &distances);
        if (distances.front() > reach) continue;
        heights(row, column) = HeightThrough(points, indices, distances, place.x(), place.y());
      }
    }
  });
  return heights;
}

/// NaN further than the margin from the hull of the points.
void CutBeyond(const Points& points, const GroundGrid& grid, double margin, cv::Mat1f* heights) {
  std::vector<cv::Point2f> places, hull;
  for (const Eigen::Vector3f& point : points) places.emplace_back(point.x(), point.y());
  cv::convexHull(places, hull);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2f place = grid.At(column, row).cast<float>();
      if (cv::pointPolygonTest(hull, {place.x(), place.y()}, true) < -margin)
        (*heights)(row, column) = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

}  // namespace

void SurfaceOptions::Check() const { CheckOptions("", *this); }

Surface FitSurface(const std::vector<Eigen::Vector3d>& landmarks, double unit,
                   const SurfaceOptions& options) {
  options.Check();
  const auto fewest = static_cast<size_t>(options.min_landmarks);
  if (landmarks.size() < fewest) {
    throw Error("the map has {} landmarks: expected at least {} for a surface", landmarks.size(),
                fewest);
  }
  const Extent extent = ExtentOf(landmarks);
  float spacing = 0;
  const Points points = WithoutOutliers(NearPoints(landmarks, extent), options, &spacing);
  if (points.size() < fewest || !(spacing > 0)) {
    throw Error("the map has {} landmarks that make a surface: expected at least {}", points.size(),
                fewest);
  }
  Surface surface;
  surface.grid = GridOver(points, spacing, unit, options);
  surface.height = HeightsNearLandmarks(points, surface.grid, spacing, options);
  FillGaps(&surface.height);
  constexpr int kMedianSide = 3;
  cv::medianBlur(surface.height, surface.height, kMedianSide);
  CutBeyond(points, surface.grid, options.margin_spacings * static_cast<double>(spacing),
            &surface.height);
  surface.grid.west += extent.middle.x();
  surface.grid.north += extent.middle.y();
  surface.base = extent.middle.z();
  surface.landmarks = static_cast<int>(points.size());
  surface.outliers = static_cast<int>(landmarks.size() - points.size());
  return surface;
}

}  // namespace deepuav
