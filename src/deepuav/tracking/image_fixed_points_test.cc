#include "deepuav/tracking/image_fixed_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "deepuav/geometry/se3.h"

namespace deepuav {
namespace {

constexpr int kDimension = 32;

Camera TestCamera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.pinhole = {500, 500, 319.5, 239.5};
  return camera;
}

/// Points that stand, each with a descriptor of its own, and some that are part of the image.
class World {
 public:
  World(int count, double nearest, double farthest) {
    for (int i = 0; i < count; ++i) {
      const double distance = nearest * std::pow(farthest / nearest, Uniform(0, 1));
      // All around, so that any path sees some.
      Eigen::Vector3d direction(Gaussian(), Gaussian(), Gaussian());
      points_.push_back(distance * direction.normalized());
      descriptors_.push_back(AnyDescriptor());
    }
  }
  /// Writing in the upper left corner.
  void AddWriting(int count) {
    for (int i = 0; i < count; ++i) {
      writing_.emplace_back(20 + 16 * (i % 10), 20 + 16 * (i / 10));
      writing_descriptors_.push_back(AnyDescriptor());
    }
  }
  void RemoveWriting() { writing_.clear(); }

  Frame Look(int64_t id, const SE3& cam_from_world) {
    Features features;
    features.descriptors = Descriptors(kDimension);
    const auto add = [&](const Eigen::Vector2d& px, const std::vector<float>& descriptor) {
      const Eigen::Vector2f seen =
          (px + 0.3 * Eigen::Vector2d(Gaussian(), Gaussian())).cast<float>();
      features.keypoints.push_back({seen, seen, 1, 1});
      features.descriptors.Append(descriptor);
    };
    const Camera camera = TestCamera();
    for (size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d point = cam_from_world * points_[i];
      if (point.z() < 0.5) continue;
      const Eigen::Vector2d px = camera.pinhole.Project(point);
      if (px.x() < 0 || px.y() < 0 || px.x() > 639 || px.y() > 479) continue;
      add(px, descriptors_[i]);
    }
    for (size_t i = 0; i < writing_.size(); ++i) add(writing_[i], writing_descriptors_[i]);
    Frame frame;
    frame.id = FrameId{id};
    frame.features = std::make_shared<const Features>(std::move(features));
    return frame;
  }

 private:
  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.;
  }
  double Gaussian() {
    double sum = 0;
    for (int i = 0; i < 12; ++i) sum += Uniform(-0.5, 0.5);
    return sum;
  }
  std::vector<float> AnyDescriptor() {
    std::vector<float> row(kDimension);
    float squares = 0;
    for (float& value : row) {
      value = static_cast<float>(Gaussian());
      squares += value * value;
    }
    for (float& value : row) value /= std::sqrt(squares);
    return row;
  }

  std::mt19937 random_{7};
  std::vector<Eigen::Vector3d> points_;
  std::vector<std::vector<float>> descriptors_;
  std::vector<Eigen::Vector2d> writing_;
  std::vector<std::vector<float>> writing_descriptors_;
};

using Path = std::function<SE3(double step)>;  ///< cam_from_world of a step.

/// Straight ahead along z, swaying.
SE3 Ahead(double step) {
  const Eigen::Vector3d turn(0.02 * std::sin(0.2 * step), 0.06 * std::sin(0.13 * step), 0);
  const SE3 world_from_cam(RotationExp(turn), {0, 0, 0.3 * step});
  return world_from_cam.Inverse();
}

SE3 AheadWithoutTurning(double step) {
  return SE3(Eigen::Quaterniond::Identity(), {0, 0, -0.3 * step});
}

/// About a point 30 in front, which stays in the middle of the image.
SE3 Orbit(double step) {
  const Eigen::Quaterniond turn = RotationExp({0, 0.01 * step, 0});
  const SE3 world_from_cam(turn, Eigen::Vector3d(0, 0, 30) - turn * Eigen::Vector3d(0, 0, 30));
  return world_from_cam.Inverse();
}

SE3 Turning(double step) { return SE3(RotationExp({0, 0.01 * step, 0}), {0, 0, 0}); }

void Fly(const Path& path, int from, int frames, World* world, ImageFixedPoints* fixed) {
  for (int i = from; i < from + frames; ++i) {
    TrackedPose pose;
    pose.map = MapId{0};
    pose.cam_from_world = path(i);
    fixed->Learn(world->Look(i, pose.cam_from_world), pose);
  }
}

ImageFixedPoints Nothing() { return {TestCamera(), ImageFixedOptions{}}; }

TEST(ImageFixedPoints, FindsWritingOnceTheCameraHasTurned) {
  World world(6000, 5, 300);
  world.AddWriting(30);
  ImageFixedPoints fixed = Nothing();
  Fly(Ahead, 0, 60, &world, &fixed);
  for (const Eigen::Vector2f& px : {Eigen::Vector2f(20, 20), Eigen::Vector2f(164, 52)})
    EXPECT_TRUE(fixed.region().Covers(px)) << px.transpose();
  EXPECT_LT(fixed.region().Share(), 0.06) << "its own place and around it";

  const Frame frame = world.Look(100, Ahead(100));
  const Frame without = fixed.Without(frame);
  EXPECT_LE(without.features->size(), frame.features->size() - 30);
  EXPECT_GT(without.features->size(), frame.features->size() * 3 / 4);
  for (const Keypoint& keypoint : without.features->keypoints)
    EXPECT_FALSE(fixed.region().Covers(keypoint.image_px));
}

TEST(ImageFixedPoints, ForgetsWhatIsThereNoMore) {
  World world(20'000, 5, 300);
  world.AddWriting(30);
  ImageFixedPoints fixed = Nothing();
  Fly(Ahead, 0, 60, &world, &fixed);
  const double share = fixed.region().Share();
  ASSERT_GT(share, 0);
  world.RemoveWriting();
  const auto around_here = [](double step) { return Ahead(std::fmod(step, 60)); };
  Fly(around_here, 60, 1000, &world, &fixed);
  EXPECT_LT(fixed.region().Share(), share / 4) << "but where nothing else was seen since";
}

TEST(ImageFixedPoints, NothingThatStandsIsTakenForFixed) {
  const std::pair<const char*, Path> paths[] = {{"ahead", Ahead},
                                                {"without turning", AheadWithoutTurning},
                                                {"orbit", Orbit},
                                                {"turning", Turning}};
  for (const auto& [name, path] : paths) {
    World world(6000, 5, 1e5);
    ImageFixedPoints fixed = Nothing();
    Fly(path, 0, 200, &world, &fixed);
    EXPECT_TRUE(fixed.region().empty()) << name;
  }
}

TEST(ImageFixedPoints, FindsWritingInAPureTurn) {
  World world(6000, 5, 300);
  world.AddWriting(30);
  ImageFixedPoints fixed = Nothing();
  Fly(Turning, 0, 60, &world, &fixed);
  EXPECT_TRUE(fixed.region().Covers({20, 20}));
}

TEST(ImageFixedPoints, AStillCameraTellsNothing) {
  World world(6000, 5, 300);
  world.AddWriting(30);
  ImageFixedPoints fixed = Nothing();
  Fly([](double) { return SE3(); }, 0, 100, &world, &fixed);
  EXPECT_TRUE(fixed.region().empty());
}

TEST(ImageFixedPoints, DoubtsAPoseThatAllKeyPointsContradict) {
  World world(6000, 5, 300);
  ImageFixedPoints fixed = Nothing();
  // The camera hovers, and is believed to turn.
  for (int i = 0; i < 100; ++i) {
    TrackedPose pose;
    pose.map = MapId{0};
    pose.cam_from_world = Turning(i);
    fixed.Learn(world.Look(i, SE3()), pose);
  }
  EXPECT_TRUE(fixed.region().empty());
}

TEST(ImageFixedPoints, DoesNotCompareAcrossAMoveOfTheMap) {
  World world(6000, 5, 300);
  world.AddWriting(30);
  ImageFixedPoints fixed = Nothing();
  for (int i = 0; i < 60; ++i) {
    TrackedPose pose;
    pose.map = MapId{0};
    pose.map_revision = i;
    pose.cam_from_world = Ahead(i);
    fixed.Learn(world.Look(i, pose.cam_from_world), pose);
  }
  EXPECT_TRUE(fixed.region().empty());
}

TEST(ImageFixedPoints, MayBeToldNotTo) {
  World world(6000, 5, 300);
  world.AddWriting(30);
  ImageFixedOptions options;
  options.set_aside = false;
  ImageFixedPoints fixed(TestCamera(), options);
  Fly(Ahead, 0, 60, &world, &fixed);
  EXPECT_TRUE(fixed.region().empty());
}

}  // namespace
}  // namespace deepuav
