#include "deepuav/looping/essential_graph.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "support/map_builder.h"
#include "support/options_with.h"
#include "support/sim3_problems.h"

namespace deepuav {
namespace {

constexpr int kKeyframes = 60;

/// A circle mapped with a drift of heading and scale, whose end was found at its beginning.
class EssentialGraphTest : public testing::Test {
 protected:
  EssentialGraphTest() : builder_(1, 100) {
    Random random(2);
    loop_ = MakeDriftingLoop(kKeyframes, 1, 1, 0.15, 0.25, &random);
    for (const Sim3& node : loop_.graph.node_from_world) {
      ids_.push_back(builder_.AddKeyframe(SE3(node.rotation(), node.translation())));
      if (ids_.size() > 1) map().ConnectToParent(ids_.back(), ids_[ids_.size() - 2]);
    }
    const PoseGraphEdge& closure = loop_.graph.edges.back();
    const Sim3 new_cam_from_world = closure.a_from_b * Sim3(map().At(ids_.front()).cam_from_world);
    moved_[ids_.back()] = new_cam_from_world.Inverse() * Sim3(map().At(ids_.back()).cam_from_world);
  }

  Map& map() { return builder_.map; }
  /// Poses after the correction.
  std::vector<SE3> Correct(const std::vector<LoopTie>& ties) {
    std::vector<SE3> poses;
    for (const KeyframeMove& move : OptimiseEssentialGraph(map(), moved_, ties, {})) {
      EXPECT_EQ(move.keyframe, ids_[poses.size()]);
      poses.push_back(move.new_from_old.MovePose(map().At(move.keyframe).cam_from_world));
      scales_.push_back(move.new_from_old.scale());
    }
    return poses;
  }
  /// How far the correction moves one keyframe against another.
  double Change(size_t a, size_t b) {
    const auto moves = OptimiseEssentialGraph(map(), moved_, Closure(), {});
    return (moves[a].new_from_old.Inverse() * moves[b].new_from_old).Log().norm();
  }
  std::vector<LoopTie> Closure() const { return {{ids_.back(), ids_.front(), {}}}; }
  double Error(const std::vector<SE3>& poses) const {
    double sum = 0;
    for (size_t i = 0; i < poses.size(); ++i) {
      sum += (poses[i].InverseTranslation() - loop_.truth[i].InverseTranslation()).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(poses.size()));
  }
  std::vector<SE3> Mapped() {
    std::vector<SE3> poses;
    for (KeyframeId id : ids_) poses.push_back(map().At(id).cam_from_world);
    return poses;
  }

  MapBuilder builder_;
  SyntheticLoop loop_;
  std::vector<KeyframeId> ids_;
  std::map<KeyframeId, Sim3> moved_;
  std::vector<double> scales_;
};

TEST_F(EssentialGraphTest, PullsTheDriftOutOfALoop) {
  const double before = Error(Mapped());
  ASSERT_GT(before, 1) << "on a circle of radius 10";
  const std::vector<SE3> poses = Correct(Closure());
  ASSERT_EQ(poses.size(), size_t{kKeyframes});
  EXPECT_LT(Error(poses), before / 10);

  // The end lies where the loop says, and the root has stayed.
  const SE3 found = poses.back() * poses.front().Inverse();
  const SE3 truth = loop_.truth.back() * loop_.truth.front().Inverse();
  EXPECT_LT(PoseDifference(found, truth), 0.1);
  EXPECT_LT(PoseDifference(poses.front(), Mapped().front()), 1e-12);
  EXPECT_EQ(scales_.front(), 1);
  EXPECT_NEAR(scales_.back(), std::exp(-0.25 * (kKeyframes - 1) / kKeyframes), 0.02)
      << "lengths had grown by as much";
  for (size_t i = 1; i < scales_.size(); ++i) EXPECT_LT(scales_[i], scales_[i - 1] + 0.01) << i;
}

TEST_F(EssentialGraphTest, TheRootStaysEvenWhereItSeesTheLoopsNewerEnd) {
  moved_[ids_.front()] = moved_.at(ids_.back());
  const std::vector<SE3> poses = Correct(Closure());
  EXPECT_LT(PoseDifference(poses.front(), Mapped().front()), 1e-12);
  EXPECT_LT(Error(poses), Error(Mapped()) / 10);

  map().Reroot(ids_[20]);
  EXPECT_LT(PoseDifference(Correct(Closure())[20], Mapped()[20]), 1e-12);
}

TEST_F(EssentialGraphTest, KeepsEarlierLoops) {
  const double unbound = Change(10, 40);
  ASSERT_GT(unbound, 0.5);
  map().AddLoop(ids_[10], ids_[40]);
  EXPECT_LT(Change(10, 40), unbound / 4);
}

TEST_F(EssentialGraphTest, KeepsStrongCovisibility) {
  const double unbound = Change(10, 40);
  for (int i = 0; i < 99; ++i) builder_.AddLandmark({ids_[10], ids_[40]}, i);
  EXPECT_EQ(Change(10, 40), unbound) << "not strong enough";
  builder_.AddLandmark({ids_[10], ids_[40]}, 99);
  EXPECT_LT(Change(10, 40), unbound / 4);
}

TEST_F(EssentialGraphTest, TakesSeveralTies) {
  std::vector<LoopTie> ties = Closure();
  // The one before the last was found at the second: where the truth has it.
  const KeyframeId before_last = ids_[kKeyframes - 2];
  moved_[before_last] = moved_.at(ids_.back());
  ties.insert(ties.begin(), {before_last, ids_[1], {}});
  EXPECT_LT(Error(Correct(ties)), Error(Mapped()) / 8);
}

TEST(EssentialGraphOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(EssentialGraphOptions().Check());
  EXPECT_THROW(OptionsWith(&EssentialGraphOptions::min_shared_landmarks, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&EssentialGraphOptions::loop_weight, 0).Check(), Error);
  EssentialGraphOptions inner;
  inner.pose_graph.max_iterations = -1;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
