#include "deepuav/tracking/pair_measurement.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "deepuav/features/readout_correction.h"
#include "deepuav/patches/local_warp.h"
#include "deepuav/patches/patch_measurement.h"

namespace deepuav {
namespace {

const Keypoint& KeypointOf(const Frame& frame, int index) {
  return frame.features->keypoints[static_cast<size_t>(index)];
}

/// Moves b's pixel to where its image shows a's patch.
void Measure(const Frame& a, const Keypoint& in_a, const Frame& b, const Keypoint& in_b,
             const Eigen::Matrix2d& b_from_a, const Camera& camera, const PatchOptions& options,
             double detected_sigma_px, PixelPair* pair) {
  const auto aligned = AlignPatch(*a.image, in_a.image_px.cast<double>(), b_from_a, *b.image,
                                  in_b.image_px.cast<double>(), options);
  if (!aligned) return;
  const DetectedPixel known{in_b.image_px.cast<double>(), PixelInRow(in_b, b.motion, camera),
                            b.motion};
  const auto measured = Undistorted(aligned->px, aligned->noise, known, camera);
  if (!measured) return;
  pair->b_px = measured->px.cast<double>();
  // The noise is that of one pixel relative to the other, half of it either's.
  const double sigma_px = measured->noise.SigmaPx() / std::numbers::sqrt2;
  pair->noise_ratio = std::min(1.0, sigma_px / detected_sigma_px);
}

void MeasureAll(const Frame& a, const Frame& b, const std::vector<Match>& matches,
                const Camera& camera, const PatchOptions& options, double detected_sigma_px,
                std::vector<PixelPair>* pairs) {
  std::vector<PointPair> in_images;
  in_images.reserve(matches.size());
  for (const Match& match : matches) {
    in_images.push_back({KeypointOf(a, match.a).image_px.cast<double>(),
                         KeypointOf(b, match.b).image_px.cast<double>()});
  }
  const auto warps = LocalWarps(in_images);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!warps[i]) continue;
    Measure(a, KeypointOf(a, matches[i].a), b, KeypointOf(b, matches[i].b), *warps[i], camera,
            options, detected_sigma_px, &(*pairs)[i]);
  }
}

/// A turn that is not known moves the ends of an image against its middle.
double UnknownTurnPx(const Frame& frame, int keypoint, const Camera& camera,
                     double turn_sigma_rad_s) {
  const double sigma_rad =
      frame.turn_is_measured ? frame.turn_sigma_rad : turn_sigma_rad_s * camera.readout_s;
  const double moment = RowMoment(KeypointOf(frame, keypoint).image_px.y(), camera.height);
  return sigma_rad * std::abs(moment) * camera.pinhole.fx;
}

}  // namespace

std::vector<PixelPair> DetectedPairs(const Frame& a, const Frame& b,
                                     const std::vector<Match>& matches) {
  std::vector<PixelPair> pairs;
  pairs.reserve(matches.size());
  for (const Match& match : matches) {
    pairs.push_back(
        {KeypointOf(a, match.a).px.cast<double>(), KeypointOf(b, match.b).px.cast<double>()});
  }
  return pairs;
}

void MeasurePairs(const Frame& a, const Frame& b, const std::vector<Match>& matches,
                  const Camera& camera, const PatchOptions& options, const PairNoise& noise,
                  std::vector<PixelPair>* pairs) {
  if (options.enabled && a.image && b.image)
    MeasureAll(a, b, matches, camera, options, noise.detected_sigma_px, pairs);
  if (camera.readout_s == 0) return;
  for (size_t i = 0; i < matches.size(); ++i) {
    // The noise is that of one pixel relative to the other, half of it either's.
    const double unknown_px =
        std::hypot(UnknownTurnPx(a, matches[i].a, camera, noise.turn_sigma_rad_s),
                   UnknownTurnPx(b, matches[i].b, camera, noise.turn_sigma_rad_s)) /
        std::numbers::sqrt2;
    PixelPair& pair = (*pairs)[i];
    pair.noise_ratio = std::hypot(pair.noise_ratio, unknown_px / noise.detected_sigma_px);
  }
}

}  // namespace deepuav
