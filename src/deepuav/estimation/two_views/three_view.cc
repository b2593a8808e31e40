#include "deepuav/estimation/two_views/three_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/estimation/poses/reprojection.h"

namespace deepuav {
namespace {

constexpr int kIterations = 15;
/// Over the bound of an error: points that are further off at first are wrong matches, which in
/// numbers lead even a robust loss astray.
constexpr double kFirstBound = 4;

std::array<Eigen::Vector2d, 3> PixelsOf(const PixelTriple& triple) {
  return {triple.a_px, triple.b_px, triple.c_px};
}

std::array<Eigen::Vector3d, 3> InCameras(const ThreeViews& views, const Eigen::Vector3d& point_a) {
  return {point_a, views.b_from_a * point_a, views.c_from_a * point_a};
}

/// The largest of the three squared errors; infinite behind a view, and where a pixel is
/// not finite.
double SquaredError(const Pinhole& pinhole, const PixelTriple& triple, const ThreeViews& views,
                    const Eigen::Vector3d& point_a) {
  const auto points = InCameras(views, point_a);
  const auto pixels = PixelsOf(triple);
  double largest = 0;
  for (size_t view = 0; view < pixels.size(); ++view) {
    if (!InFrontOfCamera(points[view])) return std::numeric_limits<double>::infinity();
    const double squared = (pinhole.Project(points[view]) - pixels[view]).squaredNorm();
    if (!std::isfinite(squared)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, squared);
  }
  return largest;
}

}  // namespace

void AdjustThreeViews(const Pinhole& pinhole, const std::vector<PixelTriple>& triples,
                      double max_error_px, ThreeViews* views) {
  BundleOptions options;
  options.max_iterations = kIterations;
  BundleProblem bundle;
  bundle.pinhole = pinhole;
  bundle.cam_from_world = {SE3(), views->b_from_a, views->c_from_a};
  bundle.camera_fixed = {1, 0, 0};
  const double sigma_px = max_error_px / std::sqrt(options.chi_square);
  std::vector<size_t> triple_of_landmark;
  for (size_t i = 0; i < triples.size(); ++i) {
    const double squared = SquaredError(pinhole, triples[i], *views, views->points_a[i]);
    if (!(squared <= std::pow(kFirstBound * max_error_px, 2))) continue;
    const int landmark = static_cast<int>(triple_of_landmark.size());
    triple_of_landmark.push_back(i);
    bundle.landmarks_world.push_back(views->points_a[i]);
    int camera = 0;
    for (const Eigen::Vector2d& px : PixelsOf(triples[i]))
      bundle.observations.push_back({camera++, landmark, px, sigma_px * triples[i].noise_ratio});
  }
  AdjustBundle(&bundle, options);
  views->b_from_a = bundle.cam_from_world[1];
  views->c_from_a = bundle.cam_from_world[2];
  for (size_t landmark = 0; landmark < triple_of_landmark.size(); ++landmark)
    views->points_a[triple_of_landmark[landmark]] = bundle.landmarks_world[landmark];
}

std::vector<double> TruncatedErrors(const Pinhole& pinhole, const std::vector<PixelTriple>& triples,
                                    const ThreeViews& views, double max_error_px) {
  std::vector<double> errors;
  errors.reserve(triples.size());
  for (size_t i = 0; i < triples.size(); ++i) {
    const double squared = SquaredError(pinhole, triples[i], views, views.points_a[i]);
    errors.push_back(std::min(1.0, squared / (max_error_px * max_error_px)));
  }
  return errors;
}

std::vector<double> WeightedErrors(const Pinhole& pinhole, const std::vector<PixelTriple>& triples,
                                   const ThreeViews& views, double max_error_px) {
  std::vector<double> errors;
  errors.reserve(triples.size());
  for (size_t i = 0; i < triples.size(); ++i) {
    const double squared = SquaredError(pinhole, triples[i], views, views.points_a[i]);
    errors.push_back(std::min(1.0, squared / std::pow(max_error_px * triples[i].noise_ratio, 2)));
  }
  return errors;
}

}  // namespace deepuav
