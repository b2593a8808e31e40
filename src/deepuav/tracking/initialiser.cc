#include "deepuav/tracking/initialiser.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "deepuav/base/logging.h"
#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"
#include "deepuav/tracking/pair_measurement.h"

namespace deepuav {
namespace {

/// By the median of how far what two frames show has moved.
double PictureRateRadS(const Frame& a, const Frame& b, const std::vector<PixelPair>& detected,
                       const Camera& camera) {
  const double interval_s = std::abs(SecondsBetween(a.time, b.time));
  if (camera.readout_s == 0 || detected.empty() || interval_s == 0) return 0;
  std::vector<double> moved_px;
  moved_px.reserve(detected.size());
  for (const PixelPair& pair : detected) moved_px.push_back((pair.b_px - pair.a_px).norm());
  return Median(std::move(moved_px)) / (camera.pinhole.fx * interval_s);
}

}  // namespace

void InitialiserOptions::Check() const { CheckOptions("initialiser", *this); }

Initialiser::Initialiser(const Camera& camera, const InitialiserOptions& options,
                         const PatchOptions& patches, Matcher* matcher)
    : camera_(camera), options_(options), patches_(patches), matcher_(matcher) {
  options_.Check();
}

void Initialiser::Reset() { firsts_.clear(); }

std::optional<InitialMapRequest> Initialiser::Add(const Frame& frame, std::string* waiting_for) {
  if (frame.features->size() < options_.min_keypoints) {
    *waiting_for = fmt::format("key points: {} of at least {}", frame.features->size(),
                               options_.min_keypoints);
    return std::nullopt;
  }
  ForgetOldViews(frame.id);
  Recognised recognised;
  if (auto request = Confirm(frame, &recognised)) return request;
  Propose(frame, &recognised, waiting_for);
  if (!recognised.by_first || recognised.newest_share < options_.min_first_share)
    AddFirstView(frame, recognised.by_first);
  return std::nullopt;
}

void Initialiser::ForgetOldViews(FrameId now) {
  const auto age = [&](const Frame& frame) { return now.value - frame.id.value; };
  for (FirstView& first : firsts_) {
    if (!first.second) continue;
    const int64_t between_views = age(first.frame) - age(first.second->frame);
    const int64_t most = std::max<int64_t>(options_.max_second_age_frames, between_views);
    if (age(first.second->frame) > most) first.second.reset();
  }
  std::erase_if(firsts_, [&](const FirstView& first) {
    return !first.second && age(first.frame) > options_.max_first_age_frames;
  });
}

/// The oldest first view comes first: it has the most parallax. Of several that have not enough,
/// the reason of one that the frame matches says more.
void Initialiser::Propose(const Frame& second, Recognised* recognised, std::string* waiting_for) {
  bool proposed = false;
  std::string reason;
  for (FirstView& first : firsts_) {
    if (first.second) continue;
    std::string of_this;
    ProposeFrom(&first, second, &of_this);
    proposed = first.second.has_value();
    if (proposed) break;
    const bool matched = first.unmatched_frames == 0;
    if (reason.empty() || matched) reason = of_this;
    recognised->by_first |= matched;
    recognised->newest_share =
        first.matched / std::max(1.0, static_cast<double>(first.most_matched));
  }
  std::erase_if(firsts_, [&](const FirstView& first) {
    return first.unmatched_frames > options_.max_unmatched_frames;
  });
  LimitPairs();
  const bool none_waits = reason.empty() && !firsts_.empty();
  if (proposed || recognised->by_pair || none_waits)
    reason = "a third view that confirms the first two";
  *waiting_for = reason.empty() ? "a second view" : reason;
}

void Initialiser::ProposeFrom(FirstView* first, const Frame& second, std::string* waiting_for) {
  std::vector<Match> matches = matcher_->MatchFeatures(*first->frame.features, *second.features);
  const int matched = first->matched = static_cast<int>(matches.size());
  first->most_matched = std::max(first->most_matched, matched);
  if (matched < options_.min_matches) {
    *waiting_for = fmt::format("matches: {} of at least {}", matched, options_.min_matches);
    ++first->unmatched_frames;
    return;
  }
  std::vector<PixelPair> pairs = PairsOf(first->frame, second, matches);
  int agreeing = 0;
  auto result = EstimateTwoView(camera_.pinhole, pairs, static_cast<uint64_t>(second.id.value),
                                options_.two_view, &agreeing);
  if (agreeing < options_.two_view.min_inliers) {
    *waiting_for = fmt::format("matches that agree: {} of at least {}", agreeing,
                               options_.two_view.min_inliers);
    ++first->unmatched_frames;
    return;
  }
  first->unmatched_frames = 0;
  if (!result) {
    *waiting_for = "parallax";
    return;
  }
  first->second = SecondView{second, std::move(matches), std::move(pairs), std::move(*result)};
}

std::vector<PixelPair> Initialiser::PairsOf(const Frame& a, const Frame& b,
                                            const std::vector<Match>& matches) const {
  std::vector<PixelPair> pairs = DetectedPairs(a, b, matches);
  const double turn_sigma_rad_s =
      std::max(options_.turn_sigma_rad_s,
               options_.turn_sigma_of_rate * PictureRateRadS(a, b, pairs, camera_));
  MeasurePairs(a, b, matches, camera_, patches_, {options_.two_view.min_sigma_px, turn_sigma_rad_s},
               &pairs);
  return pairs;
}

/// A pair gives way to another alone: frames that match nothing may be a burst of blur, which it
/// outlasts.
void Initialiser::LimitPairs() {
  const auto pairs = std::count_if(firsts_.begin(), firsts_.end(),
                                   [](const FirstView& first) { return first.second.has_value(); });
  if (pairs <= options_.max_pairs) return;
  auto longest_unseen = firsts_.end();
  for (auto first = firsts_.begin(); first != firsts_.end(); ++first) {
    if (!first->second) continue;
    if (longest_unseen == firsts_.end() ||
        first->second->unseen_frames >= longest_unseen->second->unseen_frames)
      longest_unseen = first;
  }
  firsts_.erase(longest_unseen);
}

/// A frame that matches no first view that waits for a second becomes one too, if there is room:
/// the camera may have turned away, those be blurred, or this be the second view of the only one.
/// So does one that goes on from those that it matches, in place of the oldest.
void Initialiser::AddFirstView(const Frame& frame, bool goes_on) {
  const auto waits = [](const FirstView& first) { return !first.second; };
  if (std::count_if(firsts_.begin(), firsts_.end(), waits) >= options_.max_first_views) {
    if (!goes_on) return;
    firsts_.erase(std::find_if(firsts_.begin(), firsts_.end(), waits));
  }
  firsts_.push_back({frame});
}

/// The pair of the oldest first view comes first. One that is confirmed is tried once: should it
/// not hold as a map, the others are there.
std::optional<InitialMapRequest> Initialiser::Confirm(const Frame& third, Recognised* recognised) {
  for (auto first = firsts_.begin(); first != firsts_.end(); ++first) {
    if (!first->second) continue;
    if (auto request = ConfirmPair(&*first, third)) {
      firsts_.erase(first);
      return request;
    }
    recognised->by_pair |= first->second && first->second->unseen_frames == 0;
  }
  return std::nullopt;
}

std::vector<SeenThrice> Initialiser::FollowInto(const Frame& third, const FirstView& first) const {
  const SecondView& second = *first.second;
  std::vector<int> match_of_keypoint(second.frame.features->keypoints.size(), -1);
  for (size_t i = 0; i < second.matches.size(); ++i)
    match_of_keypoint[static_cast<size_t>(second.matches[i].b)] = static_cast<int>(i);
  std::vector<size_t> matches;
  std::vector<Match> first_to_third;
  for (const Match& on : matcher_->MatchFeatures(*second.frame.features, *third.features)) {
    const int match = match_of_keypoint[static_cast<size_t>(on.a)];
    if (match < 0) continue;
    matches.push_back(static_cast<size_t>(match));
    first_to_third.push_back({second.matches[matches.back()].a, on.b, on.score});
  }
  // Both by the patches of the first view: nothing adds up.
  const std::vector<PixelPair> pairs = PairsOf(first.frame, third, first_to_third);
  const double more_noise = LeastSigmaPx(second.result) / options_.two_view.min_sigma_px;
  std::vector<SeenThrice> seen;
  for (size_t i = 0; i < matches.size(); ++i) {
    const PixelPair& in_second = second.pairs[matches[i]];
    const double noise_ratio = std::max(in_second.noise_ratio, pairs[i].noise_ratio);
    seen.push_back(
        {matches[i],
         {pairs[i].a_px, in_second.b_px, pairs[i].b_px, std::min(1.0, more_noise * noise_ratio)}});
  }
  return seen;
}

std::optional<InitialMapRequest> Initialiser::ConfirmPair(FirstView* first, const Frame& third) {
  SecondView& second = *first->second;
  const std::vector<SeenThrice> seen = FollowInto(third, *first);
  std::vector<Confirmation> found;
  bool is_seen = false, refuted = true;
  for (const TwoViewSolution& solution : second.result.solutions) {
    found.push_back(ConfirmBy(camera_.pinhole, solution, seen,
                              static_cast<uint64_t>(third.id.value), options_.two_view,
                              options_.absolute_pose));
    const Confirmation& of_this = found.back();
    is_seen |= of_this.confirmed > 0;
    if (Confirms(of_this) || of_this.matched < options_.min_confirmed) refuted = false;
  }
  second.unseen_frames = is_seen ? 0 : second.unseen_frames + 1;
  for (size_t i = 0; i < found.size(); ++i) {
    const Confirmation& best = found[i];
    if (!Confirms(best) || best.confirmed < options_.min_confirmed) continue;
    if (best.baseline_ratio < options_.third_parallax_ratio) continue;
    if (!IsAlone(i, found, options_.min_lead)) continue;
    const TwoViewSolution& solution = second.result.solutions[i];
    Log().debug(
        "frames {} and {}: {} points of {} matches, {} of known distance, {:.1f} degrees of "
        "parallax; {} of {} confirmed by frame {}",
        first->frame.id.value, second.frame.id.value, solution.valid_count, second.matches.size(),
        solution.certain_count, solution.median_parallax_deg, best.confirmed, best.matched,
        third.id.value);
    return MakeRequest(*first, solution);
  }
  if (refuted && ++second.refutations == options_.max_refutations) first->second.reset();
  return std::nullopt;
}

bool Initialiser::Confirms(const Confirmation& found) const {
  return found.confirmed >= options_.min_confirmed_ratio * found.matched;
}

InitialMapRequest Initialiser::MakeRequest(const FirstView& first,
                                           const TwoViewSolution& solution) {
  const SecondView& second = *first.second;
  InitialMapRequest request{first.frame, second.frame, solution.b_from_a, {}};
  for (size_t i = 0; i < second.matches.size(); ++i) {
    if (!solution.certain[i]) continue;
    request.points.push_back({solution.points_a[i], second.matches[i].a, second.matches[i].b});
  }
  return request;
}

}  // namespace deepuav
