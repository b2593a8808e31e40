#include "deepuav/survey/growth/survey_joining.h"

#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/survey/growth/map_link.h"
#include "deepuav/survey/growth/survey_growth.h"
#include "deepuav/survey/growth/survey_start.h"

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

/// Those that lead from a photograph of the map to one outside.
std::vector<MatchedPair> LeadingOut(const std::vector<MatchedPair>& pairs, const SurveyState& map) {
  std::vector<MatchedPair> leading;
  for (const MatchedPair& pair : pairs) {
    if (map.Has(pair.a) != map.Has(pair.b)) leading.push_back(pair);
  }
  return leading;
}

/// Makes maps of the photographs outside of a map, one after the other.
class SideMaps {
 public:
  SideMaps(const BuiltSurvey& map, const std::vector<MatchedPair>& pairs,
           const std::set<int>& taken, double image_width_px, const SurveyOptions& options,
           const std::function<bool()>& stop)
      : map_(map),
        pairs_(pairs),
        leading_(LeadingOut(pairs, map.state)),
        mapped_(ViewsIn(map.state)),
        tried_alone_(taken),
        tried_leading_(taken),
        taken_(taken),
        image_width_px_(image_width_px),
        options_(options),
        stop_(stop),
        lens_(map.state.lens) {
    lens_.is_refined = false;
  }

  /// The next one, into which some photographs of the map have grown; those that it has alone.
  /// First of photographs outside alone; those that do not come to the map so, or at which nothing
  /// starts, once more from a pair that leads to it.
  std::optional<std::pair<SurveyState, std::set<int>>> Next() {
    if (auto side = From(pairs_, WithMapped(tried_alone_), &tried_alone_)) return side;
    return From(leading_, tried_leading_, &tried_leading_);
  }

 private:
  std::set<int> WithMapped(std::set<int> views) const {
    views.insert(mapped_.begin(), mapped_.end());
    return views;
  }

  /// Of the map at most the photograph that it starts from is in it before it has grown to its end.
  std::optional<std::pair<SurveyState, std::set<int>>> From(const std::vector<MatchedPair>& pairs,
                                                            const std::set<int>& no_start,
                                                            std::set<int>* tried) const {
    const std::set<int> elsewhere = WithMapped(*tried);
    std::optional<SurveyGrowth> side =
        FindStart(map_.tracks, map_.px, RankStartPairs(pairs, map_.px, no_start, image_width_px_),
                  lens_, elsewhere, image_width_px_, options_, stop_);
    if (!side) return std::nullopt;
    side->Grow(static_cast<int>(map_.px.size()), elsewhere, stop_);
    side->Settle(stop_);
    std::set<int> outside = ViewsIn(side->state());
    for (const int view : mapped_) outside.erase(view);
    side->Grow(static_cast<int>(outside.size()) + options_.joining.common_views, taken_, stop_);
    tried->insert(outside.begin(), outside.end());
    return std::pair(side->state(), std::move(outside));
  }

  const BuiltSurvey& map_;
  const std::vector<MatchedPair>& pairs_;
  const std::vector<MatchedPair> leading_;
  const std::set<int> mapped_;
  /// Photographs of other maps, and of earlier ones of these that started so.
  std::set<int> tried_alone_, tried_leading_;
  const std::set<int>& taken_;
  const double image_width_px_;
  const SurveyOptions& options_;
  const std::function<bool()>& stop_;
  SurveyLens lens_;
};

}  // namespace

bool JoinOutside(const BuiltSurvey& map, const std::vector<MatchedPair>& pairs,
                 const std::set<int>& taken, double image_width_px, const SurveyOptions& options,
                 const std::function<bool()>& stop,
                 const std::function<bool(const SurveyState&)>& accept) {
  SideMaps sides(map, pairs, taken, image_width_px, options, stop);
  while (!(stop && stop())) {
    const auto side = sides.Next();
    if (!side) return false;
    const auto& [state, outside] = *side;
    const auto link =
        FindMapLink(map.tracks, map.px, map.state, state, outside, options.max_error_px);
    if (link)
      Log().debug("a map of {} photographs outside: {} of {} sights agree, scale to {:.2f} %",
                  outside.size(), link->agreeing, link->sights, 100 * link->scale_sigma);
    if (link && link->agreeing >= options.joining.min_sights &&
        link->agreeing >= options.joining.min_ratio * link->sights &&
        link->scale_sigma <= options.joining.max_scale_sigma &&
        accept(Together(map.state, state, outside, link->main_from_side)))
      return true;
  }
  return false;
}

}  // namespace deepuav
