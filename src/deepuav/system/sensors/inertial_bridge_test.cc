#include "deepuav/system/sensors/inertial_bridge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/system/sensors/inertial_gauge.h"
#include "support/inertial_flight.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

const SE3 kCamFromImu(RotationExp({0.1, -0.2, 0.3}), {0.05, 0.02, -0.1});
constexpr double kFirst_s = 1, kRate_hz = 10;
constexpr int kFrames = 180, kBlind = 100, kSees = 120;  // The frames between see nothing.

/// Records of a flight of an exact sensor in two maps, each of a world of its own.
class InertialBridgeTest : public testing::Test {
 protected:
  InertialBridgeTest() : world_(StripOfGround(1, 1200)), made_(world_, 2) {
    camera_.pinhole = world_.world().pinhole;
    camera_.width = 752;
    camera_.height = 480;
    imu_.cam_from_imu = kCamFromImu;
    imu_.noise = {1e-4, 1e-5, 2e-3, 1e-3};
    imu_.samples = InertialFlight().Samples(0, kFirst_s + kFrames / kRate_hz + 1, 200);
    for (int i = 0; i < kFrames; ++i) {
      FrameRecord& record = records_.emplace_back();
      record.id = FrameId{1000 + i};
      record.time = AtSeconds(TimeOf(i));
    }
  }

  static double TimeOf(int i) { return kFirst_s + i / kRate_hz; }
  static SE3 TrueWorldFromCam(int i) {
    return InertialFlight().WorldFromImu(TimeOf(i)) * kCamFromImu.Inverse();
  }

  /// A map that holds the poses of the frames from `first` to the one before `last`.
  void AddMap(const Sim3& map_from_level, int first, int last) {
    const MapId map = made_.AddMap();
    const Visit visit = made_.Add(map, {LookDown({0, 0, 12}, 0), LookDown({3, 0, 12}, 0)},
                                  map_from_level, {0.3, 0.3, 0, 0});
    const Keyframe& anchor = made_.atlas.At(map).At(visit.keyframes[0]);
    for (int i = first; i < last; ++i) {
      FrameRecord& record = records_[static_cast<size_t>(i)];
      const SE3 cam_from_map = map_from_level.MovePose(TrueWorldFromCam(i).Inverse());
      record.map = map;
      record.pose = {anchor.id, cam_from_map * anchor.cam_from_world.Inverse(), anchor.scale};
    }
  }

  struct Outcome {
    int joined = 0;
    std::vector<ReckonedFrame> reckoned;
  };
  Outcome Bridge() {
    Mapper mapper(camera_, {}, &made_.atlas, nullptr);
    InertialGauge gauge(imu_, {}, nullptr, &mapper, &made_.atlas);
    const auto attempts = gauge.ApplyToAll(made_.atlas.Remaining(), records_, nullptr);
    InertialBridge bridge(imu_, {}, nullptr, attempts, &mapper, &made_.atlas);
    Outcome outcome;
    outcome.joined = bridge.JoinMaps(records_);
    outcome.reckoned = bridge.Reckon(records_);
    TakeReckoned(made_.atlas, outcome.reckoned, &records_);
    return outcome;
  }

  /// The farthest that a frame lies from where it truly was, once the frames before agree.
  double FarthestFrom(const std::vector<int>& frames) {
    const auto in_map = [&](int i) {
      const FrameRecord& record = records_[static_cast<size_t>(i)];
      return made_.atlas.At(record.map).PoseOf(record.pose).Inverse();
    };
    const SE3 map_from_true = in_map(50) * TrueWorldFromCam(50).Inverse();
    double farthest = 0;
    for (const int i : frames) {
      const Eigen::Vector3d expected = map_from_true * TrueWorldFromCam(i).translation();
      farthest = std::max(farthest, (in_map(i).translation() - expected).norm());
    }
    return farthest;
  }

  const FeatureWorld world_;
  SyntheticVisits made_;
  Camera camera_;
  std::vector<FrameRecord> records_;
  ImuStream imu_;
  const Sim3 kFirstMap{0.1, RotationExp({0.4, 0.2, -1}), {2, 1, -3}};
  const Sim3 kSecondMap{0.3, RotationExp({-0.4, 0.3, 2}), {-5, 1, 3}};
};

TEST_F(InertialBridgeTest, MapsBeforeAndAfterBecomeOne) {
  AddMap(kFirstMap, 0, kBlind);
  AddMap(kSecondMap, kSees, kFrames);
  const Outcome outcome = Bridge();
  EXPECT_EQ(outcome.joined, 1);
  EXPECT_EQ(made_.atlas.Remaining(), std::vector<MapId>{MapId{0}});
  EXPECT_EQ(made_.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kMetric);
  EXPECT_EQ(made_.atlas.At(MapId{0}).KeyframeCount(), 4);
  EXPECT_EQ(outcome.reckoned.size(), kSees - kBlind);
  EXPECT_LT(FarthestFrom({0, 60, kBlind - 1}), 0.05);
  EXPECT_LT(FarthestFrom({kBlind, 110, kSees - 1}), 0.1);
  EXPECT_LT(FarthestFrom({kSees, 150, kFrames - 1}), 0.2);
  EXPECT_TRUE(records_[110].reckoned);
  EXPECT_FALSE(records_[150].reckoned);
}

TEST_F(InertialBridgeTest, AMapTooShortForAScaleOfItsOwnIsJoinedToo) {
  AddMap(kFirstMap, 0, kBlind);
  AddMap(kSecondMap, kSees, kSees + 20);
  EXPECT_EQ(Bridge().joined, 1);
  EXPECT_LT(FarthestFrom({110, kSees, kSees + 19}), 0.15);
}

TEST_F(InertialBridgeTest, AMapTooShortForAScaleMayBeTheFirst) {
  AddMap(kFirstMap, kBlind - 20, kBlind);
  AddMap(kSecondMap, kSees, kFrames);
  EXPECT_EQ(Bridge().joined, 1);
  EXPECT_EQ(made_.atlas.Remaining(), std::vector<MapId>{MapId{0}});
  EXPECT_EQ(made_.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kMetric);
}

TEST_F(InertialBridgeTest, FramesLostWithinAMapAreReckoned) {
  AddMap(kFirstMap, 0, kFrames);
  for (int i = kBlind; i < kSees; ++i) records_[static_cast<size_t>(i)].map = {};
  const Outcome outcome = Bridge();
  EXPECT_EQ(outcome.joined, 0);
  EXPECT_EQ(outcome.reckoned.size(), kSees - kBlind);
  EXPECT_LT(FarthestFrom({kBlind, 110, kSees - 1}), 0.05);
}

TEST_F(InertialBridgeTest, NothingIsBridgedForTooLong) {
  AddMap(kFirstMap, 0, 70);
  AddMap(kSecondMap, 125, kFrames);
  const Outcome outcome = Bridge();
  EXPECT_EQ(outcome.joined, 0);
  EXPECT_TRUE(outcome.reckoned.empty());
}

TEST_F(InertialBridgeTest, AContradictionIsNotBridged) {
  AddMap(kFirstMap, 0, kBlind);
  AddMap(kSecondMap, kSees, kFrames);
  // While the camera saw nothing the sensor was shaken loose: half a turn that the poses don't
  // have.
  for (ImuSample& sample : imu_.samples) {
    if (sample.time > AtSeconds(TimeOf(kBlind + 5)) && sample.time < AtSeconds(TimeOf(kSees - 5)))
      sample.angular_velocity.x() += 1;
  }
  const Outcome outcome = Bridge();
  EXPECT_EQ(outcome.joined, 0);
  EXPECT_TRUE(outcome.reckoned.empty());
  EXPECT_EQ(made_.atlas.Remaining().size(), 2u);
}

TEST_F(InertialBridgeTest, AJumpWithinAMapIsNotReckonedOver) {
  AddMap(kFirstMap, 0, kFrames);
  for (int i = kBlind; i < kFrames; ++i) {
    FrameRecord& record = records_[static_cast<size_t>(i)];
    if (i < kSees) {
      record.map = {};
      continue;
    }
    const SE3& cam = record.pose.cam_from_keyframe;
    record.pose.cam_from_keyframe =
        SE3(cam.rotation(), cam.translation() + Eigen::Vector3d(2, 0, 0));
  }
  EXPECT_TRUE(Bridge().reckoned.empty());
}

TEST_F(InertialBridgeTest, WithoutMetresNothingIsDone) {
  AddMap(kFirstMap, kBlind - 20, kBlind);
  AddMap(kSecondMap, kSees, kSees + 20);
  EXPECT_EQ(Bridge().joined, 0);
  EXPECT_EQ(made_.atlas.Remaining().size(), 2u);
}

}  // namespace
}  // namespace deepuav
