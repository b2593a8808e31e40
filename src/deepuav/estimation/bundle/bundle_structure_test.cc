#include "deepuav/estimation/bundle/bundle_structure.h"

#include <gmock/gmock.h>

#include <limits>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Four cameras, the first fixed; five landmarks, of which the last is not seen.
BundleProblem Problem() {
  BundleProblem problem;
  problem.pinhole = {450, 440, 376, 240};
  problem.cam_from_world.resize(4);
  problem.camera_fixed = {1, 0, 0, 0};
  problem.landmarks_world.assign(5, Eigen::Vector3d(0, 0, 5));
  const auto see = [&](int camera, int landmark) {
    BundleObservation observation;
    observation.camera = camera;
    observation.landmark = landmark;
    observation.px = {100.0 + camera, 100.0 + landmark};
    problem.observations.push_back(observation);
  };
  see(2, 0);
  see(0, 0);
  see(1, 0);
  see(1, 1);
  see(2, 1);
  see(3, 2);  // seen once: does not move
  see(2, 3);
  see(0, 3);
  return problem;
}

TEST(BundleStructure, MovesWhatIsSeenTwiceAndTheCamerasThatSeeIt) {
  const BundleStructure structure(Problem());
  EXPECT_THAT(structure.landmark_of_group, ElementsAre(0, 1, 3));
  EXPECT_THAT(structure.camera_of_free, ElementsAre(1, 2));
  EXPECT_THAT(structure.group_begin, ElementsAre(0, 3, 5, 7));
}

TEST(BundleStructure, GroupsObservationsByLandmarkFixedCamerasFirst) {
  const BundleStructure structure(Problem());
  std::vector<int> cameras;
  for (const GroupedObservation& one : structure.observations) cameras.push_back(one.camera);
  EXPECT_THAT(cameras, ElementsAre(0, 1, 2, 1, 2, 0, 2));
  for (int group = 0; group < structure.groups(); ++group) {
    for (int i = structure.group_begin[group]; i < structure.group_begin[group + 1]; ++i) {
      EXPECT_EQ(structure.observations[i].group, group);
      EXPECT_EQ(structure.observations[i].px.y(), 100 + structure.landmark_of_group[group]);
    }
  }
}

TEST(BundleStructure, ListsTheObservationsOfEachFreeCamera) {
  const BundleStructure structure(Problem());
  EXPECT_THAT(structure.camera_begin, ElementsAre(0, 2, 5));
  for (int camera = 0; camera < structure.free_cameras(); ++camera) {
    for (int i = structure.camera_begin[camera]; i < structure.camera_begin[camera + 1]; ++i)
      EXPECT_EQ(structure.observations[structure.camera_observations[i]].free_camera, camera);
  }
}

TEST(BundleStructure, LeavesUnusableObservationsAndLandmarksOut) {
  BundleProblem problem = Problem();
  problem.observations[3].px.x() = kNan;  // of landmark 1, which is then seen once
  problem.landmarks_world[3].z() = kNan;
  const BundleStructure structure(problem);
  EXPECT_THAT(structure.landmark_of_group, ElementsAre(0));
  EXPECT_THAT(structure.camera_of_free, ElementsAre(1, 2));
}

TEST(BundleStructure, AnEmptyProblemHasNothing) {
  BundleProblem problem;
  problem.pinhole = {450, 440, 376, 240};
  const BundleStructure structure(problem);
  EXPECT_EQ(structure.groups(), 0);
  EXPECT_EQ(structure.free_cameras(), 0);
}

TEST(CheckBundleProblem, NamesWhatDoesNotFit) {
  EXPECT_NO_THROW(CheckBundleProblem(Problem()));
  const auto refused = [](const auto& spoil, const char* part) {
    BundleProblem problem = Problem();
    spoil(&problem);
    EXPECT_THAT([&] { CheckBundleProblem(problem); }, ThrowsMessage<Error>(HasSubstr(part)));
  };
  refused([](BundleProblem* p) { p->pinhole.fx = 0; }, "fx 0");
  refused([](BundleProblem* p) { p->k1 = kNan; }, "k1 nan");
  refused([](BundleProblem* p) { p->camera_fixed.pop_back(); }, "camera_fixed has 3");
  refused(
      [](BundleProblem* p) {
        p->cam_from_world[2] = SE3(Eigen::Quaterniond::Identity(), {kNan, 0, 0});
      },
      "pose of camera 2");
  refused([](BundleProblem* p) { p->observations[4].camera = 4; }, "observation 4 is of camera 4");
  refused([](BundleProblem* p) { p->observations[0].landmark = -1; }, "landmark -1");
}

}  // namespace
}  // namespace deepuav
