#include "deepuav/survey/growth/survey_start.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/base/median.h"

namespace deepuav {
namespace {

/// Half a factor of 1.4 from any of these a bundle adjustment finds the rest of the way. The given
/// focal length comes first.
constexpr double kFocalRatios[] = {1, 0.7, 1.4, 0.5, 2, 0.36, 2.8};
constexpr double kOtherFocalSigma = 0.3;
/// Focal lengths over the width of an image that no drone's camera has.
constexpr double kShortestFocal = 0.3, kLongestFocal = 12;

double MedianMotionPx(const MatchedPair& pair, const ViewPixels& px) {
  std::vector<double> motions;
  for (const Match& match : pair.matches) {
    motions.push_back((px[static_cast<size_t>(pair.a)][static_cast<size_t>(match.a)].px -
                       px[static_cast<size_t>(pair.b)][static_cast<size_t>(match.b)].px)
                          .norm());
  }
  return motions.empty() ? 0 : Median(std::move(motions));
}

struct Trial {
  SurveyGrowth growth;
  double support = 0;
  bool is_given_focal = false;
};

class StartSearch {
 public:
  StartSearch(const Tracks& tracks, const ViewPixels& px, const SurveyLens& lens,
              const std::set<int>& taken, double image_width_px, const SurveyOptions& options,
              const std::function<bool()>& stop)
      : tracks_(tracks),
        px_(px),
        lens_(lens),
        taken_(taken),
        image_width_px_(image_width_px),
        options_(options),
        stop_(stop) {}

  bool Stopped() const { return stop_ && stop_(); }

  /// The best of what starts with the pair. Where the photographs don't tell the focal length, it
  /// is held at what it is said to be.
  std::optional<Trial> TryPair(const MatchedPair& pair) const {
    std::vector<Trial> trials = TryFocalLengths(pair);
    if (trials.empty()) return std::nullopt;
    if (!lens_.is_refined || TellFocal(trials)) return Best(trials);
    // What a few photographs can't tell, more of them may.
    for (Trial& trial : trials) {
      trial.growth.Grow(options_.rival_views, taken_, stop_);
      trial.support = trial.growth.Support();
      Log().debug("grown to {} views, support {:.0f}: {:.0f} px", trial.growth.state().ViewCount(),
                  trial.support, trial.growth.state().lens.camera.pinhole.fx);
    }
    const Trial& best = Best(trials);
    if (TellFocal(trials)) return best;
    SurveyLens held = lens_;
    held.holds_focal = true;
    const auto trial = TryLens(pair, held, options_.rival_views);
    const bool is_as_good = trial && trial->support >= options_.held_focal_support * best.support;
    Log().debug("the photographs don't tell the focal length: it is {} at {:.0f} px",
                is_as_good ? "held" : "not held", lens_.camera.pinhole.fx);
    return is_as_good ? *trial : best;
  }

 private:
  /// One for each focal length from which something grows.
  std::vector<Trial> TryFocalLengths(const MatchedPair& pair) const {
    std::vector<Trial> trials;
    for (const double ratio : kFocalRatios) {
      const bool is_given = ratio == 1;
      if ((!is_given && !lens_.is_refined) || Stopped()) break;
      SurveyLens lens = lens_;
      lens.camera.pinhole.fx *= ratio;
      lens.camera.pinhole.fy *= ratio;
      const double over_width = lens.camera.pinhole.fx / image_width_px_;
      if (!is_given) {
        if (over_width < kShortestFocal || over_width > kLongestFocal) continue;
        // Where this one is right, what said otherwise is wrong and must not pull.
        lens.focal_guess_px = lens.camera.pinhole.fx;
        lens.focal_sigma = std::max(lens.focal_sigma, kOtherFocalSigma);
      }
      std::optional<Trial> trial = TryLens(pair, lens, options_.trial_views);
      if (!trial) continue;
      trial->is_given_focal = is_given;
      trials.push_back(std::move(*trial));
    }
    return trials;
  }

  const Trial& Best(const std::vector<Trial>& trials) const {
    const Trial* best = &trials.front();
    for (const Trial& trial : trials) {
      const double lead = best->is_given_focal ? options_.focal_lead : 1;
      if (trial.support > lead * best->support) best = &trial;
    }
    return *best;
  }

  /// Whether those that explain about as much as the best come to about the same.
  bool TellFocal(const std::vector<Trial>& trials) const {
    double best_support = 0;
    for (const Trial& trial : trials) best_support = std::max(best_support, trial.support);
    double shortest = std::numeric_limits<double>::infinity(), longest = 0;
    for (const Trial& trial : trials) {
      if (trial.support < options_.focal_rival_support * best_support) continue;
      const double focal_px = trial.growth.state().lens.camera.pinhole.fx;
      shortest = std::min(shortest, focal_px);
      longest = std::max(longest, focal_px);
    }
    return longest <= options_.focal_agreement * shortest;
  }

  std::optional<Trial> TryLens(const MatchedPair& pair, const SurveyLens& lens, int views) const {
    std::optional<Trial> best;
    const SurveyGrowth empty(&tracks_, &px_, lens, options_);
    for (const SE3& pose : empty.PosesOf(pair)) {
      SurveyGrowth growth = empty;
      if (!growth.Start(pair, pose)) continue;
      growth.Grow(views, taken_, stop_);
      const double support = growth.Support();
      Log().debug(
          "start with photographs {} and {} at {:.0f} px: {} views, support {:.0f}, now "
          "{:.0f} px, k1 {:.3f}",
          pair.a, pair.b, lens.camera.pinhole.fx, growth.state().ViewCount(), support,
          growth.state().lens.camera.pinhole.fx, growth.state().lens.camera.k1);
      if (!best || support > best->support) best = Trial{std::move(growth), support};
    }
    return best;
  }

  const Tracks& tracks_;
  const ViewPixels& px_;
  const SurveyLens& lens_;
  const std::set<int>& taken_;
  const double image_width_px_;
  const SurveyOptions& options_;
  const std::function<bool()>& stop_;
};

}  // namespace

std::vector<const MatchedPair*> RankStartPairs(const std::vector<MatchedPair>& pairs,
                                               const ViewPixels& px, const std::set<int>& taken,
                                               double image_width_px) {
  constexpr double kMovedEnough = 0.2;  // of the width: more is not better
  std::vector<std::pair<double, const MatchedPair*>> scored;
  for (const MatchedPair& pair : pairs) {
    if (taken.contains(pair.a) || taken.contains(pair.b)) continue;
    const double moved = MedianMotionPx(pair, px) / (kMovedEnough * image_width_px);
    scored.emplace_back(static_cast<double>(pair.matches.size()) * std::min(1.0, moved), &pair);
  }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<const MatchedPair*> ranked;
  for (const auto& [score, pair] : scored) ranked.push_back(pair);
  return ranked;
}

std::optional<SurveyGrowth> FindStart(const Tracks& tracks, const ViewPixels& px,
                                      const std::vector<const MatchedPair*>& pairs,
                                      const SurveyLens& lens, const std::set<int>& taken,
                                      double image_width_px, const SurveyOptions& options,
                                      const std::function<bool()>& stop) {
  const StartSearch search(tracks, px, lens, taken, image_width_px, options, stop);
  std::optional<Trial> best;
  const size_t most = static_cast<size_t>(options.trial_pairs);
  for (size_t i = 0; i < pairs.size() && i < most && !search.Stopped(); ++i) {
    std::optional<Trial> trial = search.TryPair(*pairs[i]);
    if (!trial) continue;
    if (!best || trial->growth.state().ViewCount() > best->growth.state().ViewCount())
      best = std::move(trial);
    if (best->growth.state().ViewCount() >= options.trial_views) break;
  }
  if (!best || best->growth.state().ViewCount() < options.min_map_views) return std::nullopt;
  return std::move(best->growth);
}

}  // namespace deepuav
