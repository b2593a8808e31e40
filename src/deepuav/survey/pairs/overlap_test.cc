#include "deepuav/survey/pairs/overlap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr double kHeightM = 40;

/// Photographs of level ground, of a lens that bends by k1; each knows all points that it shows.
struct MappedGround {
  MappedGround(const std::vector<SE3>& poses, double k1) {
    SurveyLens lens;
    lens.camera.pinhole = world.pinhole;
    lens.camera.k1 = k1;
    Random random(1);
    points = LandmarksOnGround(3000, {-80, -60}, {200, 60}, 0, &random);
    tracks.tracks.resize(points.size());
    for (size_t v = 0; v < poses.size(); ++v) {
      std::vector<int>& of_view = tracks.of_keypoint.emplace_back();
      for (size_t t = 0; t < points.size(); ++t) {
        if (!Shows(poses[v], points[t])) continue;
        tracks.tracks[t].sights.push_back({static_cast<int>(v), static_cast<int>(of_view.size())});
        of_view.push_back(static_cast<int>(t));
      }
    }
    state.emplace(tracks, poses.size(), lens);
    for (size_t v = 0; v < poses.size(); ++v) state->cam_from_world[v] = poses[v];
    for (size_t t = 0; t < points.size(); ++t) state->points[t] = points[t];
  }

  bool Shows(const SE3& pose, const Eigen::Vector3d& point) const {
    const Eigen::Vector3d in_camera = pose * point;
    if (in_camera.z() <= 0) return false;
    const Eigen::Vector2d px = world.pinhole.Project(in_camera);
    return px.x() >= 0 && px.y() >= 0 && px.x() < world.width && px.y() < world.height;
  }

  std::vector<PairCandidate> Pairs(const SurveyOptions& options = {}) const {
    return OverlappingPairs(tracks, *state, {world.width, world.height}, options);
  }

  SyntheticWorld world;
  std::vector<Eigen::Vector3d> points;
  Tracks tracks;
  std::optional<SurveyState> state;
};

/// Six photographs in a row, each of which shows 70 % of what the next does, 40 % of the one after
/// that, and 10 % of the third.
std::vector<SE3> Row() {
  std::vector<SE3> poses;
  for (int i = 0; i < 6; ++i) poses.push_back(LookDown({20.0 * i, 0, kHeightM}, M_PI / 2));
  return poses;
}

/// Of a row of so many, each with the next so many.
std::vector<PairCandidate> Neighbours(int views, int reach) {
  std::vector<PairCandidate> pairs;
  for (int a = 0; a < views; ++a) {
    for (int b = a + 1; b < views && b <= a + reach; ++b) pairs.push_back({a, b, 0, 0});
  }
  return pairs;
}

TEST(OverlappingPairs, AreThoseThatShareEnoughOfTheGround) {
  const MappedGround ground(Row(), 0);
  SurveyOptions options;
  EXPECT_EQ(ground.Pairs(options), Neighbours(6, 2));
  options.min_overlap = 0.02;
  EXPECT_EQ(ground.Pairs(options), Neighbours(6, 3));
  options.min_overlap = 0.55;
  EXPECT_EQ(ground.Pairs(options), Neighbours(6, 1));
}

TEST(OverlappingPairs, AreForEachTheFewThatOverlapMost) {
  SurveyOptions options;
  options.overlap_neighbours = 2;  // of either side one
  const std::vector<PairCandidate> pairs = MappedGround(Row(), 0).Pairs(options);
  for (const PairCandidate& pair : Neighbours(6, 1))
    EXPECT_TRUE(std::ranges::find(pairs, pair) != pairs.end()) << pair.a;
  EXPECT_EQ(pairs.size(), 7u) << "the ends have two on one side";
  options.overlap_neighbours = 0;
  EXPECT_TRUE(MappedGround(Row(), 0).Pairs(options).empty());
}

TEST(OverlappingPairs, AreOfPhotographsWithPosesThatLookThere) {
  std::vector<SE3> poses = Row();
  const Eigen::Vector3d below(20, 0, -kHeightM);
  poses[1] = LookAt(below, below - Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY());
  MappedGround ground(poses, 0);
  ground.state->cam_from_world[4].reset();
  for (const PairCandidate& pair : ground.Pairs()) {
    for (const int view : {pair.a, pair.b}) EXPECT_TRUE(view != 1 && view != 4) << view;
  }
  EXPECT_FALSE(ground.Pairs().empty());
}

TEST(OverlappingPairs, SayByHowMuchTheFirstIsToBeTurned) {
  std::vector<SE3> poses;
  for (const int quarter : {0, 3, 2, 1, 3, 0})
    poses.push_back(
        LookDown({1.0 * quarter, 0, kHeightM}, 0.3 + quarter * M_PI / 2));  // not along an axis
  const std::vector<PairCandidate> pairs = MappedGround(poses, 0).Pairs();
  ASSERT_EQ(pairs.size(), 15u) << "all of all";
  const Eigen::Vector3d place(3, 2, 0), beside(12, 4, 0);
  for (const PairCandidate& pair : pairs) {
    const auto direction = [&](int view) -> Eigen::Vector2d {
      const SE3& pose = poses[static_cast<size_t>(view)];
      return (pose * beside - pose * place).head<2>();
    };
    Eigen::Vector2d turned = direction(pair.a);
    // Clockwise, as one looks at the image, what was right comes down.
    for (int i = 0; i < pair.quarter_turns; ++i) turned = Eigen::Vector2d(-turned.y(), turned.x());
    EXPECT_GT(turned.normalized().dot(direction(pair.b).normalized()), 0.99)
        << pair.a << " " << pair.b;
  }
}

TEST(OverlappingPairs, AreNoneWhereTheLensWouldFoldOver) {
  // The polynomial has what lies 66 degrees beside the axis in the middle of the image again.
  constexpr double kK1 = -0.2, kFoldedM = 90;
  const MappedGround ground(
      {LookDown({0, 0, kHeightM}, M_PI / 2), LookDown({kFoldedM, 0, kHeightM}, M_PI / 2)}, kK1);
  EXPECT_TRUE(ground.Pairs().empty());
}

}  // namespace
}  // namespace deepuav
