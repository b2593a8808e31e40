#include "deepuav/survey/survey_joining.h"

#include "deepuav/base/logging.h"
#include "deepuav/survey/map_link.h"
#include "deepuav/survey/survey_growth.h"
#include "deepuav/survey/survey_start.h"

namespace deepuav {
namespace {

std::set<int> ViewsIn(const SurveyState& state) {
  std::set<int> views;
  for (size_t v = 0; v < state.cam_from_world.size(); ++v) {
    if (state.cam_from_world[v]) views.insert(views.end(), static_cast<int>(v));
  }
  return views;
}

SurveyState Together(const SurveyState& main, const SurveyState& side, const std::set<int>& outside,
                     const Sim3& main_from_side) {
  SurveyState joined = main;
  for (const int view : outside) {
    const auto v = static_cast<size_t>(view);
    joined.cam_from_world[v] = main_from_side.MovePose(*side.cam_from_world[v]);
  }
  return joined;
}

}  // namespace

std::optional<SurveyState> JoinOutside(const BuiltSurvey& map,
                                       const std::vector<MatchedPair>& pairs,
                                       const std::set<int>& taken, double image_width_px,
                                       const SurveyOptions& options,
                                       const std::function<bool()>& stop) {
  const auto all = static_cast<int>(map.px.size());
  std::set<int> elsewhere = ViewsIn(map.state);
  elsewhere.insert(taken.begin(), taken.end());
  SurveyLens lens = map.state.lens;
  lens.is_refined = false;
  while (!(stop && stop())) {
    std::optional<SurveyGrowth> side =
        FindStart(map.tracks, map.px, RankStartPairs(pairs, map.px, elsewhere, image_width_px),
                  lens, elsewhere, image_width_px, options, stop);
    if (!side) return std::nullopt;
    side->Grow(all, elsewhere, stop);
    side->Settle(stop);
    const std::set<int> outside = ViewsIn(side->state());
    side->Grow(static_cast<int>(outside.size()) + options.joining.common_views, taken, stop);
    const auto link =
        FindMapLink(map.tracks, map.px, map.state, side->state(), outside, options.max_error_px);
    if (link)
      Log().debug("a map of {} photographs outside: {} of {} sights agree, scale to {:.2f} %",
                  outside.size(), link->agreeing, link->sights, 100 * link->scale_sigma);
    if (link && link->agreeing >= options.min_pose_inliers &&
        link->agreeing >= options.min_pose_ratio * link->sights &&
        link->scale_sigma <= options.joining.max_scale_sigma)
      return Together(map.state, side->state(), outside, link->main_from_side);
    elsewhere.insert(outside.begin(), outside.end());
  }
  return std::nullopt;
}

}  // namespace deepuav
