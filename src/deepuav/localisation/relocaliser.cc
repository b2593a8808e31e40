#include "deepuav/localisation/relocaliser.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <numeric>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/features/turned_describer.h"

namespace deepuav {
namespace {

LocatorOptions WithRobustPose(LocatorOptions options, const AbsolutePoseOptions& robust) {
  options.absolute_pose = robust;
  return options;
}

/// The features as found on the image turned about its centre, but for `px`, which geometry uses
/// and which stays upright.
std::shared_ptr<const Features> TurnedFeatures(const Features& upright,
                                               const Descriptors& descriptors, int quarter_turns,
                                               const Camera& camera) {
  auto turned = std::make_shared<Features>(Features{upright.keypoints, descriptors});
  const Eigen::Vector2f half_size(0.5f * static_cast<float>(camera.width),
                                  0.5f * static_cast<float>(camera.height));
  const bool sideways = quarter_turns % 2 == 1;
  const Eigen::Vector2f to_centre =
      sideways ? Eigen::Vector2f(half_size - half_size.reverse()) : Eigen::Vector2f::Zero();
  for (Keypoint& keypoint : turned->keypoints) {
    keypoint.image_px =
        TurnPixel(keypoint.image_px, quarter_turns, camera.width, camera.height) + to_centre;
  }
  return turned;
}

/// The keyframes that share most landmarks with the centre, the earlier first where equal.
std::vector<int> NearestNeighbours(const LocalMap& local_map, int count) {
  std::vector<uint8_t> of_centre(local_map.landmarks.size(), 0);
  for (int landmark : local_map.keyframes[static_cast<size_t>(local_map.centre)].landmarks) {
    if (landmark >= 0) of_centre[static_cast<size_t>(landmark)] = 1;
  }
  std::vector<std::pair<int, int>> by_shared;  // negative number shared, index
  for (size_t k = 0; k < local_map.keyframes.size(); ++k) {
    if (static_cast<int>(k) == local_map.centre) continue;
    int shared = 0;
    for (int landmark : local_map.keyframes[k].landmarks)
      shared += landmark >= 0 && of_centre[static_cast<size_t>(landmark)];
    if (shared > 0) by_shared.emplace_back(-shared, static_cast<int>(k));
  }
  std::sort(by_shared.begin(), by_shared.end());
  std::vector<int> nearest;
  for (const auto& [shared, index] : by_shared) {
    if (static_cast<int>(nearest.size()) == count) break;
    nearest.push_back(index);
  }
  return nearest;
}

/// Adds those whose key point and landmark have no match yet.
void AddNew(const std::vector<LocatedFrame::Seen>& more, const Frame& frame,
            const LocalMap& local_map, std::vector<LocatedFrame::Seen>* matches) {
  std::vector<uint8_t> keypoint_taken(static_cast<size_t>(frame.features->size()), 0),
      landmark_taken(local_map.landmarks.size(), 0);
  const auto take = [&](const LocatedFrame::Seen& seen) {
    keypoint_taken[static_cast<size_t>(seen.keypoint)] = 1;
    landmark_taken[static_cast<size_t>(seen.landmark)] = 1;
  };
  for (const LocatedFrame::Seen& seen : *matches) take(seen);
  for (const LocatedFrame::Seen& seen : more) {
    if (keypoint_taken[static_cast<size_t>(seen.keypoint)] ||
        landmark_taken[static_cast<size_t>(seen.landmark)]) {
      continue;
    }
    take(seen);
    matches->push_back(seen);
  }
}

/// Under which a candidate is tried; nothing: under all.
std::optional<int> HeadingOf(std::span<const int> headings, size_t candidate) {
  return headings.empty() ? std::nullopt : std::optional(headings[candidate]);
}

double MeanDistance(const LocatedFrame& located, const LocalMap& local_map) {
  const Eigen::Vector3d centre = located.cam_from_world.InverseTranslation();
  double sum = 0;
  for (const LocatedFrame::Seen& seen : located.seen) {
    sum += (local_map.landmarks[static_cast<size_t>(seen.landmark)].position_world - centre).norm();
  }
  return sum / static_cast<double>(std::max<size_t>(located.seen.size(), 1));
}

}  // namespace

void RelocaliserOptions::Check() const { CheckOptions("looping.relocaliser", *this); }

void RelocaliserOptions::CheckRelations() const {
  CheckOption(min_cells <= cells_per_side * cells_per_side, "min_cells", min_cells,
              "1 to the number of cells");
}

Relocaliser::Relocaliser(const Camera& camera, const RelocaliserOptions& options,
                         const LocatorOptions& locator, PlaceMatchers matchers,
                         StageListener* stages)
    : camera_(camera),
      options_((options.Check(), options)),
      local_radius_px_(locator.local_radius_px),
      locator_(camera, WithRobustPose(locator, options.absolute_pose), matchers.quick, stages),
      matchers_(matchers),
      stages_(stages) {}

std::optional<Relocaliser::Found> Relocaliser::Relocalise(
    const Frame& frame, std::span<const Descriptors> turned,
    std::span<const std::shared_ptr<const LocalMap>> candidates, std::string* reason,
    std::span<const int> headings) {
  const StageScope stage(stages_, "locate in places");
  const std::vector<View> views = ViewsOf(frame, turned, headings);
  const KeypointGrid grid(*frame.features);
  std::vector<std::optional<Found>> of_each;
  for (size_t i = 0; i < candidates.size(); ++i) {
    of_each.push_back(
        LocateViews(views, grid, *candidates[i], HeadingOf(headings, i), matchers_.quick));
  }
  const auto rank_below = [this](const auto& a, const auto& b) { return RankOf(a) < RankOf(b); };
  const auto first = std::max_element(of_each.begin(), of_each.end(), rank_below);
  if (matchers_.thorough && first != of_each.end() && !RankOf(*first).first)
    LocateThoroughly(views, grid, candidates, headings, &of_each);
  std::vector<Found> all;
  for (size_t i = 0; i < of_each.size(); ++i) {
    if (!of_each[i]) continue;
    of_each[i]->candidate = static_cast<int>(i);
    all.push_back(std::move(*of_each[i]));
  }
  const auto fail = [reason](std::string text) {
    if (reason) *reason = std::move(text);
    return std::nullopt;
  };
  if (all.empty()) return fail(fmt::format("no pose in {} candidates", candidates.size()));

  const auto best = std::max_element(all.begin(), all.end(), rank_below);
  const LocationEvidence& evidence = best->evidence;
  if (!IsSure(evidence)) {
    return fail(fmt::format("not sure: {} of {} landmarks agree, in {} cells", evidence.inliers,
                            evidence.visible, evidence.cells));
  }
  for (const Found& other : all) {
    if (other.evidence.inliers < options_.rival_ratio * evidence.inliers) continue;
    if (!Contradict(*best, other, candidates)) continue;
    return fail(fmt::format("two places fit: {} and {} landmarks agree", evidence.inliers,
                            other.evidence.inliers));
  }
  return std::move(*best);
}

void Relocaliser::LocateThoroughly(const std::vector<View>& views, const KeypointGrid& grid,
                                   std::span<const std::shared_ptr<const LocalMap>> candidates,
                                   std::span<const int> headings,
                                   std::vector<std::optional<Found>>* found) {
  std::vector<size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return RankOf((*found)[a]) > RankOf((*found)[b]); });
  bool sure = false;
  for (size_t n = 0; n < order.size(); ++n) {
    if (static_cast<int>(n) >= options_.thorough_candidates && !sure) break;
    const size_t i = order[n];
    std::optional<Found> again =
        LocateViews(views, grid, *candidates[i], HeadingOf(headings, i), matchers_.thorough);
    sure = sure || RankOf(again).first;
    if (RankOf(again) > RankOf((*found)[i])) (*found)[i] = std::move(again);
  }
}

std::pair<bool, int> Relocaliser::RankOf(const std::optional<Found>& found) const {
  return found ? RankOf(*found) : std::pair(false, 0);
}

std::pair<bool, int> Relocaliser::RankOf(const Found& found) const {
  return {IsSure(found.evidence), found.evidence.inliers};
}

std::vector<Relocaliser::View> Relocaliser::ViewsOf(const Frame& frame,
                                                    std::span<const Descriptors> turned,
                                                    std::span<const int> headings) const {
  if (!turned.empty() && turned.size() != std::tuple_size_v<TurnedDescriptors>) {
    throw Error("{} sets of turned descriptors: expected none or {}", turned.size(),
                std::tuple_size_v<TurnedDescriptors>);
  }
  std::vector<View> views = {{0, frame}};
  // Key points are corrected already for how the camera turned; how it travelled would need the
  // unit of another map, and rows that are not another image's columns.
  views[0].frame.motion = {};
  for (size_t i = 0; i < turned.size(); ++i) {
    if (turned[i].size() == 0) continue;
    if (turned[i].size() != frame.features->size()) {
      throw Error("{} turned descriptors: expected none or one for each of {} key points",
                  turned[i].size(), frame.features->size());
    }
    const int quarter_turns = static_cast<int>(i) + 1;
    const bool wanted = headings.empty() || std::find(headings.begin(), headings.end(),
                                                      quarter_turns) != headings.end();
    if (!wanted) continue;
    views.push_back({quarter_turns, views[0].frame});
    views.back().frame.features =
        TurnedFeatures(*frame.features, turned[i], quarter_turns, camera_);
  }
  return views;
}

std::optional<Relocaliser::Found> Relocaliser::LocateViews(const std::vector<View>& views,
                                                           const KeypointGrid& grid,
                                                           const LocalMap& candidate,
                                                           std::optional<int> heading,
                                                           Matcher* matcher) {
  Trial best;
  for (const View& view : views) {
    if (heading && view.quarter_turns != 0 && view.quarter_turns != *heading) continue;
    Trial trial = MatchCentre(view, candidate, matcher);
    const auto rank = [](const Trial& t) { return std::pair(t.Agreeing(), t.matches.size()); };
    if (!best.view || rank(trial) > rank(best)) best = std::move(trial);
    if (static_cast<int>(best.Agreeing()) >= options_.min_inliers) break;
  }
  if (static_cast<int>(best.Agreeing()) < options_.min_inliers)
    MatchNeighbours(candidate, matcher, &best);
  if (!best.pose) return std::nullopt;

  const Frame& frame = best.view->frame;
  LocatedFrame located =
      locator_.Refine(frame, grid, candidate, *best.pose, options_.search_radius_px);
  const CoarsePose nearly{located.cam_from_world, std::move(located.seen)};
  located = locator_.Refine(frame, grid, candidate, nearly, local_radius_px_);

  Found found;
  found.quarter_turns = best.view->quarter_turns;
  found.evidence = {static_cast<int>(best.matches.size()), static_cast<int>(best.Agreeing()),
                    static_cast<int>(located.seen.size()), static_cast<int>(located.visible.size()),
                    CellCount(views[0].frame, located)};
  found.located = std::move(located);
  return found;
}

Relocaliser::Trial Relocaliser::MatchCentre(const View& view, const LocalMap& candidate,
                                            Matcher* matcher) {
  Trial trial;
  trial.view = &view;
  const LocalKeyframe& centre = candidate.keyframes[static_cast<size_t>(candidate.centre)];
  trial.matches =
      LandmarksOf(matcher->MatchFeatures(*view.frame.features, *centre.features), centre);
  if (static_cast<int>(trial.matches.size()) >= options_.min_matches) {
    trial.pose = locator_.LocateByMatches(view.frame, candidate, trial.matches);
  }
  return trial;
}

void Relocaliser::MatchNeighbours(const LocalMap& candidate, Matcher* matcher, Trial* trial) {
  const Frame& frame = trial->view->frame;
  for (int index : NearestNeighbours(candidate, options_.neighbours)) {
    const LocalKeyframe& neighbour = candidate.keyframes[static_cast<size_t>(index)];
    const auto more =
        LandmarksOf(matcher->MatchFeatures(*frame.features, *neighbour.features), neighbour);
    AddNew(more, frame, candidate, &trial->matches);
  }
  if (static_cast<int>(trial->matches.size()) < options_.min_matches) return;
  std::optional<CoarsePose> pose = locator_.LocateByMatches(frame, candidate, trial->matches);
  if (pose && pose->seen.size() > trial->Agreeing()) trial->pose = std::move(pose);
}

int Relocaliser::CellCount(const Frame& frame, const LocatedFrame& located) const {
  const int per_side = options_.cells_per_side;
  std::vector<uint8_t> filled(static_cast<size_t>(per_side) * static_cast<size_t>(per_side), 0);
  const auto cell = [per_side](float px, int size) {
    return std::clamp(
        static_cast<int>(px / static_cast<float>(size) * static_cast<float>(per_side)), 0,
        per_side - 1);
  };
  for (const LocatedFrame::Seen& seen : located.seen) {
    const Eigen::Vector2f& px =
        frame.features->keypoints[static_cast<size_t>(seen.keypoint)].image_px;
    filled[static_cast<size_t>(cell(px.y(), camera_.height) * per_side +
                               cell(px.x(), camera_.width))] = 1;
  }
  return static_cast<int>(std::count(filled.begin(), filled.end(), 1));
}

bool Relocaliser::IsSure(const LocationEvidence& evidence) const {
  return evidence.inliers >= options_.min_inliers &&
         evidence.InlierRatio() >= options_.min_inlier_ratio &&
         evidence.cells >= options_.min_cells;
}

/// Poses in different maps never do: how these lie to each other is not known.
bool Relocaliser::Contradict(const Found& a, const Found& b,
                             std::span<const std::shared_ptr<const LocalMap>> candidates) const {
  const LocalMap& map_a = *candidates[static_cast<size_t>(a.candidate)];
  const LocalMap& map_b = *candidates[static_cast<size_t>(b.candidate)];
  if (map_a.map != map_b.map) return false;
  const SE3 a_from_b = a.located.cam_from_world * b.located.cam_from_world.Inverse();
  return a_from_b.Angle() > options_.rival_angle_deg * std::numbers::pi / 180 ||
         a_from_b.translation().norm() > options_.rival_distance * MeanDistance(a.located, map_a);
}

}  // namespace deepuav
