#include "deepuav/survey/pairs/view_pairs.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>

#include "deepuav/estimation/two_views/usac.h"

namespace deepuav {
namespace {

/// As it is.
const Features& FeaturesOf(const SurveyView& view) { return view.FeaturesAt(0); }

std::vector<cv::Point2d> PointsOf(const Features& features, const std::vector<Match>& matches,
                                  int Match::*side) {
  std::vector<cv::Point2d> points;
  points.reserve(matches.size());
  for (const Match& match : matches) {
    const Eigen::Vector2f& px = features.keypoints[static_cast<size_t>(match.*side)].image_px;
    points.emplace_back(px.x(), px.y());
  }
  return points;
}

}  // namespace

const Features& SurveyView::FeaturesAt(int halvings) const {
  if (features_by_halvings.empty()) return *frame.features;
  return *features_by_halvings[static_cast<size_t>(halvings)];
}

int SurveyView::FirstKeypoint(int halvings) const {
  int first = 0;
  for (int i = 0; i < halvings; ++i) first += FeaturesAt(i).size();
  return first;
}

PairMatching::PairMatching(const std::vector<SurveyView>* views, Matcher* quick, Matcher* learned,
                           const SurveyOptions& options)
    : views_(views), quick_(quick), learned_(learned), options_(options) {}

std::vector<MatchedPair> PairMatching::Match(const std::vector<PairCandidate>& candidates,
                                             const std::function<bool()>& stop) {
  std::map<std::pair<int, int>, std::vector<deepuav::Match>> best;
  int done = 0;
  for (const PairCandidate& candidate : candidates) {
    if (stop && stop()) break;
    if (progress_) progress_(done++, static_cast<int>(candidates.size()));
    std::vector<deepuav::Match> matches = MatchCandidate(candidate);
    if (matches.empty()) continue;
    std::vector<deepuav::Match>& known = best[{candidate.a, candidate.b}];
    if (matches.size() > known.size()) known = std::move(matches);
  }
  std::vector<MatchedPair> pairs;
  for (auto& [pair, matches] : best) pairs.push_back({pair.first, pair.second, std::move(matches)});
  return pairs;
}

std::vector<Match> PairMatching::MatchCandidate(const PairCandidate& candidate) {
  if (candidate.halvings != 0 || candidate.common_halvings != 0) return MatchReduced(candidate);
  if (candidate.quarter_turns == 0) return MatchUpright(candidate);
  return MatchTurned(candidate);
}

/// Either of both may be turned.
std::vector<Match> PairMatching::MatchTurned(const PairCandidate& candidate) {
  const SurveyView& a = (*views_)[static_cast<size_t>(candidate.a)];
  const SurveyView& b = (*views_)[static_cast<size_t>(candidate.b)];
  const auto turned = [](const SurveyView& view, int quarter_turns) -> const StoredDescriptors& {
    return view.turned[static_cast<size_t>(quarter_turns) - 1];
  };
  const StoredDescriptors& of_a = turned(a, candidate.quarter_turns);
  const StoredDescriptors& of_b = turned(b, 4 - candidate.quarter_turns);
  if (of_a.size() > 0) {
    return Verify(candidate,
                  quick_->MatchFeatures({FeaturesOf(a).keypoints, of_a.Load()}, FeaturesOf(b)));
  }
  if (of_b.size() == 0) return {};
  return Verify(candidate,
                quick_->MatchFeatures(FeaturesOf(a), {FeaturesOf(b).keypoints, of_b.Load()}));
}

std::vector<Match> PairMatching::MatchUpright(const PairCandidate& candidate) {
  const Features& a = FeaturesOf((*views_)[static_cast<size_t>(candidate.a)]);
  const Features& b = FeaturesOf((*views_)[static_cast<size_t>(candidate.b)]);
  std::vector<deepuav::Match> verified = Verify(candidate, quick_->MatchFeatures(a, b));
  const bool follow_one_another = candidate.b - candidate.a <= options_.sequence_neighbours;
  const bool is_weak = static_cast<int>(verified.size()) < options_.weak_pair_matches;
  if (!learned_ || !follow_one_another || !is_weak) return verified;
  std::vector<deepuav::Match> learned = Verify(candidate, learned_->MatchFeatures(a, b));
  return learned.size() > verified.size() ? learned : verified;
}

/// Of the two the one that is not reduced is turned; none where both are.
std::vector<Match> PairMatching::MatchReduced(const PairCandidate& candidate) {
  const SurveyView& a = (*views_)[static_cast<size_t>(candidate.a)];
  const SurveyView& b = (*views_)[static_cast<size_t>(candidate.b)];
  const int of_a = candidate.common_halvings + std::max(0, candidate.halvings);
  const int of_b = candidate.common_halvings + std::max(0, -candidate.halvings);
  if (a.Halvings() < of_a || b.Halvings() < of_b) return {};
  const bool a_is_whole = of_a == 0;
  const int turns = (a_is_whole ? candidate.quarter_turns : 4 - candidate.quarter_turns) % 4;
  Features turned;
  if (turns != 0) {
    const SurveyView& whole = a_is_whole ? a : b;
    turned = {FeaturesOf(whole).keypoints, whole.turned[static_cast<size_t>(turns) - 1].Load()};
    if (turned.descriptors.size() == 0) return {};
  }
  const Features& seen_by_a = a_is_whole && turns != 0 ? turned : a.FeaturesAt(of_a);
  const Features& seen_by_b = !a_is_whole && turns != 0 ? turned : b.FeaturesAt(of_b);
  std::vector<deepuav::Match> matches = quick_->MatchFeatures(seen_by_a, seen_by_b);
  for (deepuav::Match& match : matches) {
    match.a += a.FirstKeypoint(of_a);
    match.b += b.FirstKeypoint(of_b);
  }
  return Verify(candidate, matches);
}

std::vector<Match> PairMatching::Verify(const PairCandidate& candidate,
                                        const std::vector<deepuav::Match>& matches) const {
  const auto enough = [&](size_t agreeing) {
    return static_cast<int>(agreeing) >= options_.min_pair_matches &&
           static_cast<double>(agreeing) >=
               options_.min_pair_ratio * static_cast<double>(matches.size());
  };
  if (!enough(matches.size())) return {};
  const SurveyView& a = (*views_)[static_cast<size_t>(candidate.a)];
  const SurveyView& b = (*views_)[static_cast<size_t>(candidate.b)];
  constexpr double kConfidence = 0.999;
  constexpr int kIterations = 1000;
  const uint64_t seed =
      static_cast<uint64_t>(candidate.a) << 32 | static_cast<uint64_t>(candidate.b);
  std::vector<uint8_t> inlier;
  cv::findFundamentalMat(PointsOf(*a.frame.features, matches, &deepuav::Match::a),
                         PointsOf(*b.frame.features, matches, &deepuav::Match::b), inlier,
                         MakeUsacParams(options_.pair_error_px, kConfidence, kIterations, seed));
  std::vector<deepuav::Match> agreeing;
  for (size_t i = 0; i < inlier.size(); ++i) {
    if (inlier[i]) agreeing.push_back(matches[i]);
  }
  return enough(agreeing.size()) ? agreeing : std::vector<deepuav::Match>{};
}

}  // namespace deepuav
