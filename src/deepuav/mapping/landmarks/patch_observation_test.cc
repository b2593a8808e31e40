#include "deepuav/mapping/landmarks/patch_observation.h"

#include <gtest/gtest.h>

#include <memory>

#include "deepuav/base/random.h"
#include "support/textured_plane.h"

namespace deepuav {
namespace {

constexpr double kDetectorSigmaPx = 0.4;

Camera TestCamera() { return {320, 240, {300, 310, 160, 120}, LensModel::kPinhole, {}, 0}; }

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

/// Five views of a textured plane; key point i of each shows landmark i, off by the detector's
/// noise.
class PatchObserverTest : public ::testing::Test {
 protected:
  PatchObserverTest() {
    for (int v = 0; v < 4; ++v) {
      for (int u = 0; u < 5; ++u)
        points_.push_back(
            world_.Hit({0, 0, 0}, camera_.pinhole.Unproject({80 + 40 * u, 60 + 38 * v})));
    }
    for (int view = 0; view < 5; ++view) AddView(At({0.12 * view, 0.05 * view, 0}));
  }

  void AddView(const SE3& pose) {
    Features features{{}, Descriptors(2)};
    const float descriptor[2] = {1, 0};
    for (const Eigen::Vector3d& point : points_) {
      const Eigen::Vector2d px =
          camera_.pinhole.Project(pose * point) +
          Eigen::Vector2d(random_.Gaussian(kDetectorSigmaPx), random_.Gaussian(kDetectorSigmaPx));
      features.keypoints.push_back(
          {px.cast<float>(), px.cast<float>(), 1, static_cast<float>(kDetectorSigmaPx)});
      features.descriptors.Append(descriptor);
    }
    const KeyframeId id = ids_.NextKeyframe();
    map_.AddKeyframe(id,
                     {FrameId{id.value},
                      {},
                      std::make_shared<const Features>(features),
                      std::make_shared<const ImagePyramid>(world_.Render(camera_, pose), 3)},
                     pose);
  }

  /// Landmark i, seen by the first view, whose patch it is.
  LandmarkId AddLandmark(int i) {
    const LandmarkId id = ids_.NextLandmark();
    map_.AddLandmark(id, points_[static_cast<size_t>(i)], {0});
    map_.AddObservation(
        {0}, i, id,
        observer_.ReferenceMeasurement(map_.At(KeyframeId{0}), i, points_[static_cast<size_t>(i)]));
    map_.UpdateViewRange(id);
    return id;
  }

  /// How far the measurements of a view and of the first one are from showing one point of the
  /// plane.
  double ErrorPx(const Landmark& landmark, int view) const {
    const Keyframe& first = map_.At(KeyframeId{0});
    const Keyframe& other = map_.At(KeyframeId{view});
    Eigen::Vector2d px[2] = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
    for (const Observation& o : landmark.observations) {
      if (o.keyframe == first.id) px[0] = o.measured.px.cast<double>();
      if (o.keyframe == other.id) px[1] = o.measured.px.cast<double>();
    }
    const Eigen::Vector3d point = world_.Hit({0, 0, 0}, camera_.pinhole.Unproject(px[0]));
    return (camera_.pinhole.Project(other.cam_from_world * point) - px[1]).norm();
  }

  const TexturedPlane world_;
  const Camera camera_ = TestCamera();
  const PatchObserver observer_{camera_, PatchOptions{}, ReferenceViewOptions{}};
  Random random_{5};
  std::vector<Eigen::Vector3d> points_;
  IdSource ids_;
  Map map_{MapId{0}};
};

TEST_F(PatchObserverTest, MeasuresFarBetterThanTheDetector) {
  double squared = 0;
  int measured = 0;
  for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
    const LandmarkId id = AddLandmark(i);
    for (int view = 1; view < 5; ++view) {
      ASSERT_TRUE(observer_.AddObservation(&map_, {view}, i, id));
      const Observation& added = map_.At(id).observations.back();
      if (!added.measured.by_patch) continue;
      ++measured;
      squared += std::pow(ErrorPx(map_.At(id), view), 2);
    }
  }
  EXPECT_GT(measured, 70) << "of 80";
  EXPECT_LT(std::sqrt(squared / measured), 0.25 * kDetectorSigmaPx);
}

TEST_F(PatchObserverTest, LeavesTheKeyPointWhereItCannotMeasure) {
  const PatchObserver off(camera_, PatchOptions{.enabled = false}, ReferenceViewOptions{});
  EXPECT_FALSE(off.ReferenceMeasurement(map_.At(KeyframeId{0}), 3, points_[3]));
  const LandmarkId id = AddLandmark(3);
  ASSERT_TRUE(off.AddObservation(&map_, {1}, 3, id));
  const Observation& added = map_.At(id).observations.back();
  EXPECT_EQ(added.measured.px, map_.At(KeyframeId{1}).features().keypoints[3].px);
  EXPECT_EQ(added.measured.noise, PixelNoise(static_cast<float>(kDetectorSigmaPx)));
}

TEST_F(PatchObserverTest, MergedLandmarksAreMeasuredByOnePatch) {
  // The same point twice: once from view 0, once from views 3 and 4 with a patch of their own.
  const LandmarkId kept = AddLandmark(7);
  ASSERT_TRUE(observer_.AddObservation(&map_, {1}, 7, kept));
  const LandmarkId twin = ids_.NextLandmark();
  map_.AddLandmark(twin, points_[7], {4});
  map_.AddObservation({3}, 7, twin,
                      observer_.ReferenceMeasurement(map_.At(KeyframeId{3}), 7, points_[7]));
  ASSERT_TRUE(observer_.AddObservation(&map_, {4}, 7, twin));
  map_.UpdateViewRange(twin);
  observer_.Merge(&map_, twin, kept);
  ASSERT_FALSE(map_.Contains(twin));
  const Landmark& merged = map_.At(kept);
  ASSERT_EQ(merged.observations.size(), 4u);
  for (int view : {1, 3, 4}) EXPECT_LT(ErrorPx(merged, view), 0.15) << view;
}

TEST_F(PatchObserverTest, RemeasuringMakesAllAgreeWithTheMiddleView) {
  const LandmarkId id = AddLandmark(12);
  // What a tracker left: key points, but for the first.
  for (int view = 1; view < 5; ++view) map_.AddObservation({view}, 12, id);
  map_.UpdateViewRange(id);
  observer_.RemeasureAll(&map_);
  for (int view = 1; view < 5; ++view) EXPECT_LT(ErrorPx(map_.At(id), view), 0.2) << view;
}

TEST_F(PatchObserverTest, KnowsTheSurfaceThatLandmarksLieOn) {
  for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
    const LandmarkId id = AddLandmark(i);
    for (int view = 1; view < 5; ++view) observer_.AddObservation(&map_, {view}, i, id);
    map_.UpdateViewRange(id);
    EXPECT_EQ(map_.At(id).SurfaceNormal(), map_.At(id).mean_view_direction) << "not known yet";
  }
  const auto expect_normals_of_the_plane = [&] {
    const Eigen::Vector3d truth = -world_.Normal().normalized();
    map_.landmarks().ForEach([&](const Landmark& landmark) {
      EXPECT_GT(landmark.SurfaceNormal().dot(truth), std::cos(0.03));
      EXPECT_LT(landmark.mean_view_direction.dot(truth), std::cos(0.2));
    });
  };
  observer_.UpdateNormals({2}, &map_);
  expect_normals_of_the_plane();
  map_.landmarks().ForEach(
      [&](const Landmark& landmark) { map_.SetNormal(landmark.id, Eigen::Vector3d::Zero()); });
  observer_.RemeasureAll(&map_);
  expect_normals_of_the_plane();

  const PatchObserver facing(camera_, PatchOptions{}, ReferenceViewOptions{}, {.enabled = false});
  map_.landmarks().ForEach(
      [&](const Landmark& landmark) { map_.SetNormal(landmark.id, Eigen::Vector3d::Zero()); });
  facing.UpdateNormals({2}, &map_);
  EXPECT_EQ(map_.At(LandmarkId{0}).normal_world, Eigen::Vector3d::Zero());
}

TEST_F(PatchObserverTest, WithoutImagesNothingIsRemeasured) {
  const LandmarkId id = AddLandmark(2);
  map_.AddObservation({1}, 2, id);
  const PatchObserver off(camera_, PatchOptions{.enabled = false}, ReferenceViewOptions{});
  off.RemeasureAll(&map_);
  EXPECT_EQ(map_.At(id).observations.back().measured.px,
            map_.At(KeyframeId{1}).features().keypoints[2].px);
}

}  // namespace
}  // namespace deepuav
