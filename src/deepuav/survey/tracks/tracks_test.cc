#include "deepuav/survey/tracks/tracks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr int kViews = 6, kKeypoints = 50;

std::vector<SurveyView> EmptyViews() {
  auto features = std::make_shared<Features>();
  features->keypoints.resize(kKeypoints);
  std::vector<SurveyView> views(kViews);
  for (SurveyView& view : views) view.frame.features = features;
  return views;
}

/// Key point i of each photograph shows point i, but for some matches that are wrong.
std::vector<MatchedPair> PartlyWrongPairs() {
  constexpr double kWrongShare = 0.3;
  Random random(1);
  std::vector<MatchedPair> pairs;
  for (int a = 0; a < kViews; ++a) {
    for (int b = a + 1; b < kViews; ++b) {
      MatchedPair& pair = pairs.emplace_back(MatchedPair{a, b, {}});
      // No two pairs have as many matches: which comes first is decided by these alone.
      const int matches = kKeypoints - static_cast<int>(pairs.size());
      for (int i = 0; i < matches; ++i) {
        const bool is_wrong = random.Uniform(0, 1) < kWrongShare;
        pair.matches.push_back({i, is_wrong ? random.Index(kKeypoints) : i, 1});
      }
    }
  }
  return pairs;
}

using Sights = std::vector<std::pair<int, int>>;

Sights SightsOf(const Tracks& tracks, int view, int keypoint) {
  const int track = tracks.of_keypoint[static_cast<size_t>(view)][static_cast<size_t>(keypoint)];
  Sights sights;
  if (track < 0) return sights;
  for (const Track::Sight& sight : tracks.tracks[static_cast<size_t>(track)].sights)
    sights.emplace_back(sight.view, sight.keypoint);
  return sights;
}

TEST(JoinMatches, OfMatchesThatContradictThoseOfThePairWithMoreCount) {
  const std::vector<MatchedPair> pairs = {{0, 2, {{1, 0, 1}}},
                                          {1, 2, {{0, 0, 1}, {1, 1, 1}}},
                                          {0, 1, {{0, 0, 1}, {1, 1, 1}, {2, 2, 1}}}};
  const Tracks tracks = JoinMatches(EmptyViews(), pairs);
  ASSERT_EQ(tracks.tracks.size(), 3u);
  EXPECT_EQ(SightsOf(tracks, 0, 0), (Sights{{0, 0}, {1, 0}, {2, 0}}));
  EXPECT_EQ(SightsOf(tracks, 0, 1), (Sights{{0, 1}, {1, 1}, {2, 1}}));
  EXPECT_EQ(SightsOf(tracks, 1, 2), (Sights{{0, 2}, {1, 2}}));
  EXPECT_TRUE(SightsOf(tracks, 0, 3).empty()) << "nothing matches it";
}

TEST(JoinMatches, NoTrackHasTwoKeyPointsOfAPhotographHoweverWrongMatchesAre) {
  const Tracks tracks = JoinMatches(EmptyViews(), PartlyWrongPairs());
  ASSERT_FALSE(tracks.tracks.empty());
  size_t sights = 0, of_keypoints = 0;
  for (size_t t = 0; t < tracks.tracks.size(); ++t) {
    const std::vector<Track::Sight>& seen = tracks.tracks[t].sights;
    EXPECT_GE(seen.size(), 2u);
    EXPECT_EQ(std::ranges::adjacent_find(seen, std::ranges::greater_equal(), &Track::Sight::view),
              seen.end())
        << "by rising view, one a view";
    for (const auto& [view, keypoint] : seen)
      EXPECT_EQ(tracks.of_keypoint[static_cast<size_t>(view)][static_cast<size_t>(keypoint)],
                static_cast<int>(t));
    sights += seen.size();
  }
  for (const std::vector<int>& of_view : tracks.of_keypoint)
    of_keypoints +=
        static_cast<size_t>(std::ranges::count_if(of_view, [](int track) { return track >= 0; }));
  EXPECT_EQ(of_keypoints, sights);
}

TEST(JoinMatches, TheOrderOfPairsDecidesNothing) {
  std::vector<MatchedPair> pairs = PartlyWrongPairs();
  const Tracks in_order = JoinMatches(EmptyViews(), pairs);
  std::ranges::reverse(pairs);
  EXPECT_EQ(JoinMatches(EmptyViews(), pairs).of_keypoint, in_order.of_keypoint);
}

}  // namespace
}  // namespace deepuav
