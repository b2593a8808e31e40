#include "deepuav/features/superpoint.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "deepuav/base/option_check.h"
#include "deepuav/base/time.h"
#include "deepuav/features/lookalikes.h"

namespace deepuav {
namespace {

/// Length of undistorted pixels per pixel of the image as taken, by finite differences from the
/// pixel and its undistorted position.
std::optional<double> UndistortionMagnification(const Camera& camera,
                                                const Eigen::Vector2d& image_px,
                                                const Eigen::Vector2d& undistorted_px) {
  constexpr double kStepPx = 0.1;
  const auto right = camera.Undistort(image_px + Eigen::Vector2d(kStepPx, 0));
  const auto below = camera.Undistort(image_px + Eigen::Vector2d(0, kStepPx));
  if (!right || !below) return std::nullopt;
  Eigen::Matrix2d differences;
  differences << *right - undistorted_px, *below - undistorted_px;
  return std::sqrt(std::abs(differences.determinant())) / kStepPx;
}

}  // namespace

void SuperPointOptions::Check() const { CheckOptions("features", *this); }

SuperPointOptions SuperPointOptions::OfPhotographs() const {
  SuperPointOptions options = *this;
  options.network_pixels = photograph_pixels;
  options.of_photographs = true;
  return options;
}

void SuperPointOptions::LimitPixels(double pixels) {
  for (double* limited : {&network_pixels, &photograph_pixels})
    *limited = *limited > 0 ? std::min(*limited, pixels) : pixels;
}

SuperPoint::SuperPoint(const Camera& camera, const SuperPointOptions& options,
                       const InferenceOptions& inference)
    : camera_(camera),
      options_((options.Check(), options)),
      refiner_(options.subpixel_sigma, options.subpixel_max_offset),
      size_(camera.width, camera.height, options.network_pixels),
      network_(size_.width(), size_.height(), options.model, inference) {}

std::string SuperPoint::Description() const {
  const std::string network = network_.Description();
  if (!size_.IsReduced()) return network;
  return fmt::format("{} at {}x{}", network, size_.width(), size_.height());
}

std::optional<Keypoint> SuperPoint::MakeKeypoint(const Eigen::Vector2f& image_px,
                                                 float score) const {
  const Eigen::Vector2d px = image_px.cast<double>();
  const auto undistorted = camera_.Undistort(px);
  if (!undistorted) return std::nullopt;
  const auto magnification = UndistortionMagnification(camera_, px, *undistorted);
  if (!magnification) return std::nullopt;
  return Keypoint{image_px, undistorted->cast<float>(), score,
                  static_cast<float>(options_.sigma * size_.PixelLength() * *magnification)};
}

Features SuperPoint::Describe(const HeatMap& heat_map, const PeakOptions& peak_options,
                              const DescriptorMap& map) const {
  const std::vector<Peak> peaks = FindPeaks(heat_map, peak_options);
  Features features{{}, Descriptors(map.dimension)};
  features.keypoints.reserve(peaks.size());
  features.descriptors.Reserve(static_cast<int>(peaks.size()));
  std::vector<float> descriptor(static_cast<size_t>(map.dimension));
  for (const Peak& peak : peaks) {
    const Eigen::Vector2f centre(static_cast<float>(peak.x), static_cast<float>(peak.y));
    const Eigen::Vector2f network_px = options_.subpixel ? refiner_.Refine(heat_map, peak) : centre;
    const auto keypoint = MakeKeypoint(size_.ToImage(network_px), peak.score);
    if (!keypoint) continue;
    SampleDescriptor(map, network_px, descriptor);
    features.keypoints.push_back(*keypoint);
    features.descriptors.Append(descriptor);
  }
  return features;
}

/// Corners of what repeats itself have the best scores and tell least.
Features SuperPoint::Find(const HeatMap& heat_map) {
  PeakOptions peaks{options_.keypoints,       static_cast<float>(options_.threshold),
                    options_.nms_radius,      options_.border,
                    options_.faint_keypoints, static_cast<float>(options_.faint_threshold)};
  const DescriptorMap map = network_.ReadDescriptors();
  Features best = Describe(heat_map, peaks, map);
  if (!options_.of_photographs || options_.photograph_max_lookalikes >= 1) return best;
  // Nearer ones share cells of the descriptors' map.
  const double apart_px = 2 * kSuperPointCell * size_.PixelLength();
  const auto lookalikes_of = [&](const Features& features) {
    return CountLookalikes(features, options_.lookalike_similarity, apart_px);
  };
  if (ShareWithLookalikes(lookalikes_of(best)) <= options_.photograph_max_lookalikes) return best;
  peaks.count *= options_.distinct_candidates;
  if (options_.faint_keypoints > 0) peaks.faint_count = peaks.count;
  const Features candidates = Describe(heat_map, peaks, map);
  return MostDistinct(candidates, lookalikes_of(candidates), options_.keypoints);
}

Features SuperPoint::Extract(const GreyImage& image, ExtractionTimes* times) {
  Stopwatch stopwatch;
  network_.Run(size_.Reduce(image, &reduced_));
  const double network_s = stopwatch.Seconds();
  stopwatch.Restart();
  Features features = Find(network_.ReadHeatMap());
  if (times) *times = {network_s, stopwatch.Seconds()};
  return features;
}

}  // namespace deepuav
