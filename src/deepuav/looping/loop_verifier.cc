#include "deepuav/looping/loop_verifier.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

/// The unit of a over that of b, by the depths of the landmark pairs in camera a; robust, since
/// depths of young landmarks may be far off.
double MedianDepthRatio(const std::vector<Sim3Correspondence>& pairs, const Sim3& a_from_b) {
  std::vector<double> ratios;
  ratios.reserve(pairs.size());
  for (const Sim3Correspondence& pair : pairs)
    ratios.push_back(pair.point_a.z() / (a_from_b * pair.point_b).z());
  return Median(std::move(ratios));
}

/// Of the way between two cameras over the depth of what the second sees: where it is less, as
/// where both keyframes are of one image, reprojection errors are the same at any scale.
constexpr double kLeastParallax = 0.005;

double Parallax(const std::vector<Sim3Correspondence>& pairs, const SE3& a_from_b) {
  std::vector<double> depths;
  depths.reserve(pairs.size());
  for (const Sim3Correspondence& pair : pairs) depths.push_back(pair.point_b.z());
  return a_from_b.translation().norm() / Median(std::move(depths));
}

Sim3OptimisationResult Align(const Pinhole& pinhole, std::vector<Sim3Correspondence> pairs,
                             const SE3& a_from_b, Sim3OptimisationOptions options) {
  const double ratio = options.fixed_scale ? 1 : MedianDepthRatio(pairs, Sim3(a_from_b));
  const Sim3 scaled(SE3(), ratio);
  if (Parallax(pairs, a_from_b) >= kLeastParallax)
    return OptimiseSim3(pinhole, pairs, scaled * Sim3(a_from_b), options);
  for (Sim3Correspondence& pair : pairs) pair.point_a /= ratio;
  options.fixed_scale = true;
  Sim3OptimisationResult result = OptimiseSim3(pinhole, pairs, Sim3(a_from_b), options);
  result.a_from_b = scaled * result.a_from_b;
  return result;
}

}  // namespace

void VerifierOptions::Check() const { CheckOptions("looping.verifier", *this); }

LoopVerifier::LoopVerifier(const Pinhole& pinhole, const VerifierOptions& options,
                           Relocaliser* relocaliser)
    : pinhole_(pinhole), options_(options), relocaliser_(relocaliser) {
  options_.Check();
}

std::optional<LoopFinding> LoopVerifier::Verify(const Atlas& atlas, MapId map, KeyframeId keyframe,
                                                std::span<const Descriptors> turned,
                                                std::span<const PlaceCandidate> places,
                                                std::string* reason) {
  std::vector<std::shared_ptr<const LocalMap>> surroundings;
  std::vector<int> headings;
  for (const PlaceCandidate& place : places) {
    surroundings.push_back(MakeLocalMap(atlas.At(place.map), place.keyframe, options_.place));
    headings.push_back(place.view);
  }
  const Keyframe& query = atlas.At(map).At(keyframe);
  const auto found = relocaliser_->Relocalise(query.frame, turned, surroundings, reason, headings);
  if (!found) return std::nullopt;
  const auto index = static_cast<size_t>(found->candidate);
  return Compare(atlas.At(map), query, atlas.At(places[index].map), *surroundings[index], *found,
                 reason);
}

std::optional<LoopFinding> LoopVerifier::Compare(const Map& map, const Keyframe& keyframe,
                                                 const Map& place_map, const LocalMap& place,
                                                 const Relocaliser::Found& found,
                                                 std::string* reason) const {
  const LocalKeyframe& centre = place.keyframes[static_cast<size_t>(place.centre)];
  LoopFinding finding{map.id(),
                      place_map.id(),
                      {keyframe.id, centre.id, MatchesOf(found.located.seen, place)},
                      found.located.cam_from_world,
                      {}};
  const auto known = std::count_if(
      finding.tie.seen.begin(), finding.tie.seen.end(), [&](const LandmarkMatch& match) {
        return keyframe.landmarks[static_cast<size_t>(match.keypoint)] == match.landmark;
      });
  if (static_cast<double>(known) >
      options_.max_known_ratio * static_cast<double>(finding.tie.seen.size())) {
    if (reason) *reason = fmt::format("it sees {} landmarks of it already", known);
    return std::nullopt;
  }
  const std::vector<Sim3Correspondence> pairs = PairLandmarks(map, keyframe, place, found.located);
  if (static_cast<int>(pairs.size()) < options_.min_pairs) {
    if (reason) *reason = fmt::format("only {} landmarks are known twice", pairs.size());
    return std::nullopt;
  }

  const SE3 cam_from_centre = finding.cam_from_place_world * centre.cam_from_world.Inverse();
  const Sim3OptimisationResult refined = Align(pinhole_, pairs, cam_from_centre, options_.sim3);
  const bool agree = refined.inlier_count >= options_.min_pairs &&
                     refined.inlier_count >= options_.min_pair_ratio * double(pairs.size());
  if (!agree) {
    if (reason) {
      *reason =
          fmt::format("{} of {} landmarks known twice agree", refined.inlier_count, pairs.size());
    }
    return std::nullopt;
  }
  const Sim3 centre_from_cam_here = refined.a_from_b.Inverse();
  finding.place_from_map_world =
      Sim3(centre.cam_from_world.Inverse()) * centre_from_cam_here * Sim3(keyframe.cam_from_world);
  return finding;
}

std::vector<Sim3Correspondence> LoopVerifier::PairLandmarks(const Map& map,
                                                            const Keyframe& keyframe,
                                                            const LocalMap& place,
                                                            const LocatedFrame& located) const {
  const LocalKeyframe& centre = place.keyframes[static_cast<size_t>(place.centre)];
  std::vector<Sim3Correspondence> pairs;
  for (const LocatedFrame::Seen& seen : located.seen) {
    const LandmarkId here = keyframe.landmarks[static_cast<size_t>(seen.keypoint)];
    const LocalLandmark& there = place.landmarks[static_cast<size_t>(seen.landmark)];
    if (!here.valid() || here == there.id) continue;
    const Keypoint& keypoint = keyframe.features().keypoints[static_cast<size_t>(seen.keypoint)];
    Sim3Correspondence pair;
    pair.point_a = keyframe.cam_from_world * map.At(here).position_world;
    pair.point_b = centre.cam_from_world * there.position_world;
    pair.px_a = keypoint.px.cast<double>();
    pair.px_b = pinhole_.Project(pair.point_b);
    pair.sigma_a_px = pair.sigma_b_px = keypoint.sigma_px;
    if (UsableCorrespondence(pair)) pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace deepuav
