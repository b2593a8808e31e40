#include <gtest/gtest.h>

#include <numeric>

#include "deepuav/survey/pairs/pair_evidence.h"
#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr double kHeightM = 40;
constexpr int kPoints = 100;
// Far beyond what may be an error, but of little weight beside the image.
constexpr double kOffPx = 40;

/// Photographs of which each shows all points, key point by key point; the map knows its points by
/// those of the first one alone, so that it may be asked what others show.
struct JudgedMap {
  explicit JudgedMap(const std::vector<SE3>& poses) : views(poses.size()) {
    const SyntheticWorld world;
    SurveyLens lens;
    lens.camera.pinhole = world.pinhole;
    Random random(1);
    const auto points = LandmarksOnGround(kPoints, {-10, -8}, {10, 8}, 3, &random);
    Tracks tracks;
    tracks.of_keypoint.assign(poses.size(), std::vector<int>(kPoints, -1));
    std::iota(tracks.of_keypoint[0].begin(), tracks.of_keypoint[0].end(), 0);
    for (int t = 0; t < kPoints; ++t) tracks.tracks.push_back({{{0, t}}});
    ViewPixels px(poses.size());
    for (size_t v = 0; v < poses.size(); ++v) {
      for (const Eigen::Vector3d& point : points)
        px[v].push_back({world.pinhole.Project(poses[v] * point)});
    }
    SurveyState state(tracks, poses.size(), lens);
    for (size_t v = 0; v < poses.size(); ++v) state.cam_from_world[v] = poses[v];
    for (size_t t = 0; t < points.size(); ++t) state.points[t] = points[t];
    for (std::vector<uint8_t>& agrees : state.agrees) agrees = {1};
    map = BuiltSurvey{tracks, state, px};
    for (int i = 0; i < kPoints; ++i) pair.matches.push_back({i, i, 1});
  }

  PairJudge Judge() const { return {views, map->px, {752, 480}, options}; }
  double Share() const { return Judge().AgreeingShare(pair, *map); }
  /// What the second photograph shows is as far beside where it was.
  void ShowElsewhere(const Eigen::Vector2d& by_px) {
    for (SightPixel& sight : map->px[1]) sight.px += by_px;
  }
  void KeepPoints(size_t count) {
    for (size_t t = count; t < map->state.points.size(); ++t) map->state.agrees[t] = {0};
  }

  std::vector<SurveyView> views;
  SurveyOptions options;
  std::optional<BuiltSurvey> map;
  MatchedPair pair{0, 1, {}};
};

/// Two beside one another: epipolar lines are rows of the image.
std::vector<SE3> SideBySide() {
  return {LookDown({0, 0, kHeightM}, M_PI / 2), LookDown({4, 0, kHeightM}, M_PI / 2)};
}

TEST(PairJudge, ByPointsMatchesMustBeAtThePlaceByLinesOnTheLine) {
  JudgedMap right(SideBySide());
  EXPECT_EQ(right.Share(), 1);
  right.KeepPoints(0);
  EXPECT_EQ(right.Share(), 1);
  JudgedMap along(SideBySide());
  along.ShowElsewhere({kOffPx, 0});
  EXPECT_EQ(along.Share(), 0);
  along.KeepPoints(0);
  EXPECT_EQ(along.Share(), 1) << "a line tells no more";
  JudgedMap across(SideBySide());
  across.ShowElsewhere({0, kOffPx});
  EXPECT_EQ(across.Share(), 0);
  across.KeepPoints(0);
  EXPECT_EQ(across.Share(), 0);
}

TEST(PairJudge, SoManyPointsTellMoreThanLinesDo) {
  JudgedMap slid(SideBySide());
  slid.ShowElsewhere({kOffPx, 0});
  slid.options.evidence.telling_points = 8;
  slid.KeepPoints(8);
  EXPECT_EQ(slid.Share(), 0);
  slid.KeepPoints(7);
  EXPECT_EQ(slid.Share(), 1);
  slid.pair.matches.clear();
  EXPECT_EQ(slid.Share(), 0) << "nothing says nothing";
}

TEST(PairJudge, APairContradictsByManyMatchesAllOverAlone) {
  JudgedMap wrong(SideBySide());
  wrong.ShowElsewhere({0, kOffPx});
  const auto contradicts = [&](double coverage, size_t matches) {
    std::vector<MatchedPair> pairs = {wrong.pair};
    pairs[0].coverage = coverage;
    pairs[0].matches.resize(matches);
    return !wrong.Judge().Contradicting(&pairs, *wrong.map).empty();
  };
  const SurveyOptions& options = wrong.options;
  const auto enough = static_cast<size_t>(options.contradicting_matches);
  EXPECT_TRUE(contradicts(options.contradicting_coverage, enough));
  EXPECT_FALSE(contradicts(options.contradicting_coverage, enough - 1));
  EXPECT_FALSE(contradicts(0.9 * options.contradicting_coverage, kPoints));
  wrong.ShowElsewhere({0, -kOffPx});
  EXPECT_FALSE(contradicts(1, kPoints)) << "it is right now";
  wrong.ShowElsewhere({0, kOffPx});
  wrong.map->state.cam_from_world[1].reset();
  EXPECT_FALSE(contradicts(1, kPoints)) << "the map does not have it";
}

TEST(PairJudge, AgreementIsWhatIsExplainedLessWhatContradicts) {
  std::vector<SE3> poses = SideBySide();
  poses.push_back(LookDown({0, 4, kHeightM}, M_PI / 2));
  JudgedMap judged(poses);
  const auto agreement = [&] {
    std::vector<MatchedPair> pairs = {judged.pair, judged.pair};
    pairs[1].b = 2;
    pairs[1].matches.resize(kPoints / 2);
    for (MatchedPair& pair : pairs) pair.coverage = 1;
    return judged.Judge().Agreement(&pairs, *judged.map);
  };
  EXPECT_DOUBLE_EQ(agreement(), 1.5 * kPoints);
  judged.ShowElsewhere({0, kOffPx});
  EXPECT_DOUBLE_EQ(agreement(), -0.5 * kPoints);
  judged.map->state.cam_from_world[1].reset();
  EXPECT_DOUBLE_EQ(agreement(), 0.5 * kPoints) << "what is in no map says nothing";
}

TEST(PairJudge, FromOnePlaceADirectionCountsForALine) {
  const std::vector<SE3> poses = {LookDown({0, 0, kHeightM}, 0), LookDown({0, 0, kHeightM}, 0.5)};
  JudgedMap turned(poses);
  turned.KeepPoints(0);
  EXPECT_EQ(turned.Share(), 1);
  turned.ShowElsewhere({kOffPx, kOffPx});
  EXPECT_LT(turned.Share(), 0.1);
}

}  // namespace
}  // namespace deepuav
