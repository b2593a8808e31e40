#include "deepuav/system/sensors/place_watch.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "deepuav/system/testing/georeferencing_fixture.h"
#include "deepuav/system/testing/placed_flights.h"

namespace deepuav {
namespace {

constexpr double kRate_hz = 4, kSigma_m = 0.3;
const MapId kMap{0};

GnssFix FixAt(Timestamp time, const Eigen::Vector3d& position_m) {
  const GeoPoint point = GeoFromLocal(kOrigin, position_m);
  return {time, point.latitude_deg, point.longitude_deg, point.altitude_m,
          Eigen::Vector3d::Constant(kSigma_m)};
}

struct Told {
  MapId map;
  int64_t revision;
  PlacedWorld world;
};

class PlaceWatchTest : public testing::Test {
 protected:
  PlaceWatchTest() {
    options_.gnss.correlation_s = 0;
    receiver_.antenna_cam_m = kAntenna;
    Watch();
  }

  void Watch() {
    watch_.emplace(receiver_, options_, [this](MapId map, int64_t revision, const PlacedWorld& w) {
      const std::scoped_lock lock(mutex_);
      told_.push_back({map, revision, w});
    });
  }

  /// From one moment of the flight to another; nothing that takes its time is left behind.
  void Fly(double from_s, double to_s, bool with_fixes,
           const Eigen::Vector3d& spoofed_by = Eigen::Vector3d::Zero()) {
    for (const TimedPose& pose : flight_) {
      const double t = SecondsBetween(AtSeconds(0), pose.time);
      if (t < from_s || t >= to_s) continue;
      if (with_fixes) {
        Eigen::Vector3d at = pose.world_from_cam * kAntenna + spoofed_by;
        for (double& value : at) value += random_.Gaussian(kSigma_m);
        watch_->AddFix(FixAt(AtSeconds(t + clock_off_s_), at));
      }
      FrameRecord record;
      record.time = pose.time;
      record.map = kMap;
      record.map_revision = revision_;
      record.cam_from_world = map_from_local_.MovePose(pose.world_from_cam.Inverse());
      watch_->OnFrame(record, {});
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  std::vector<Told> End() {
    watch_.reset();
    return std::move(told_);
  }
  /// Of the camera where the flight ends, with what was told last.
  double Error(const Told& told) const {
    const Eigen::Vector3d end = flight_.back().world_from_cam.translation();
    const Eigen::Vector3d found = LocalFromLocal(kOrigin, told.world.origin) *
                                  (told.world.local_from_world * (map_from_local_ * end));
    return (found - end).norm();
  }

  Trajectory flight_ = Winding(120, kRate_hz);
  Sim3 map_from_local_ = kMapFromLocal;
  double clock_off_s_ = 0;
  Random random_{7};
  GnssStream receiver_;
  SensorUseOptions options_;
  int64_t revision_ = 3;
  std::mutex mutex_;
  std::vector<Told> told_;
  std::optional<PlaceWatch> watch_;
};

TEST_F(PlaceWatchTest, TellsThePlaceOnTheWayAndKeepsItWithoutFixes) {
  Fly(0, 60, true);
  Fly(60, 120, false);
  const auto told = End();
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told.front().map, kMap);
  EXPECT_EQ(told.front().revision, 3);
  EXPECT_LT(told.size(), 6u) << "the world does not shake";
  EXPECT_LT(Error(told.back()), 0.5);
}

TEST_F(PlaceWatchTest, AllFixesMayComeBeforeTheFirstImage) {
  flight_ = Winding(400, kRate_hz);  // Longer than what is kept of them.
  for (const TimedPose& pose : flight_)
    watch_->AddFix(FixAt(pose.time, pose.world_from_cam * kAntenna));
  Fly(0, 30, false);
  const auto told = End();
  ASSERT_FALSE(told.empty());
  EXPECT_LT(Error(told.back()), 0.5);
}

TEST_F(PlaceWatchTest, FixesThatLieElsewhereForAWhileAreLeftOut) {
  Fly(0, 60, true);
  Fly(60, 75, true, {30, 0, 0});
  Fly(75, 80, false);
  const auto told = End();
  ASSERT_FALSE(told.empty());
  EXPECT_LT(Error(told.back()), 0.5);
}

TEST_F(PlaceWatchTest, IsToldAboutTheOriginThatIsAskedFor) {
  const GeoPoint origin{47.41, 8.51, 480};
  Fly(0, 60, true);
  watch_->UseOrigin(origin);
  Fly(60, 120, false);
  const auto told = End();
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told.back().world.origin.latitude_deg, origin.latitude_deg);
  EXPECT_EQ(told.back().world.origin.altitude_m, origin.altitude_m);
  EXPECT_LT(Error(told.back()), 0.5);
}

TEST_F(PlaceWatchTest, AFarOriginIsLeftAside) {
  watch_->UseOrigin({0, 0, 0});
  Fly(0, 60, true);
  const auto told = End();
  ASSERT_FALSE(told.empty());
  EXPECT_NEAR(told.back().world.origin.latitude_deg, kOrigin.latitude_deg, 0.01);
}

TEST_F(PlaceWatchTest, ACorrectionThatContradictsNothingIsNoNews) {
  Fly(0, 40, true);
  ++revision_;
  Fly(40, 60, false);
  const auto told = End();
  ASSERT_FALSE(told.empty());
  for (const Told& one : told) EXPECT_EQ(one.revision, 3);
}

TEST_F(PlaceWatchTest, AClockThatIsSaidToBeOffIsReckonedWith) {
  options_.gnss_clock_offset_s = 7200;
  clock_off_s_ = -7200;
  Watch();
  Fly(0, 60, true);
  const auto told = End();
  ASSERT_FALSE(told.empty());
  EXPECT_LT(Error(told.back()), 0.5);
}

TEST_F(PlaceWatchTest, WhatIsKnownOfMetresCountsInItsRevisionAlone) {
  flight_ = Straight(20, kRate_hz);
  const MetricWorld metric{kMapFromLocal.Inverse(), 0.01, 0.005};
  watch_->UseMetric(kMap, revision_ + 1, metric);
  Fly(0, 20, true);
  EXPECT_TRUE(End().empty()) << "of another revision";
  Watch();
  watch_->UseMetric(kMap, revision_, metric);
  Fly(0, 20, true);
  EXPECT_FALSE(End().empty());
}

TEST_F(PlaceWatchTest, AMapThatIsMetricSaysSoUntilItsEnd) {
  flight_ = Straight(20, kRate_hz);
  map_from_local_ = Sim3(1, RotationExp({0, 0, 1}), {5, 6, 7});
  watch_->OnGauge(kMap, 0, {GaugeKind::kMetric, {}, 0.01});
  Fly(0, 20, true);
  EXPECT_FALSE(End().empty());
}

TEST_F(PlaceWatchTest, SaysNothingOfMapsThatHaveAPlace) {
  watch_->OnGauge(kMap, 0, {GaugeKind::kGeoreferenced, kOrigin, 0.01});
  Fly(0, 60, true);
  EXPECT_TRUE(End().empty());
}

TEST_F(PlaceWatchTest, SaysNothingOfLostFramesOrWithoutFixes) {
  Fly(0, 60, false);
  FrameRecord lost;
  lost.time = AtSeconds(61);
  watch_->OnFrame(lost, {});
  EXPECT_TRUE(End().empty());
}

/// On a map of keyframes that moves.
class PlaceWatchInMapTest : public GeoreferencingTest {};

TEST_F(PlaceWatchInMapTest, APlaceMovesWithTheMapWhereNoFixComesAnyMore) {
  std::mutex mutex;
  std::vector<Told> told;
  SensorUseOptions options = options_;
  options.georeference.running_pose_interval_s = 0.01;  // The keyframes are so close in time.
  {
    PlaceWatch watch(streams_.gnss, options, [&](MapId map, int64_t revision, const auto& world) {
      const std::scoped_lock lock(mutex);
      told.push_back({map, revision, world});
    });
    const auto show = [&](FrameRecord record, int seconds_later) {
      record.time.nanoseconds += int64_t{1'000'000'000} * seconds_later;
      record.cam_from_world = map().PoseOf(record.pose);
      record.map_revision = map().revision();
      watch.OnFrame(record, {});
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    };
    for (const FrameRecord& record : records_) show(record, 0);
    show(records_.back(), 4);
    map().Transform(Sim3(3, RotationExp({0.5, 0, 1}), {4, 5, 6}));
    watch.OnMapState(map());
    show(records_.back(), 8);
    show(records_.back(), 12);
  }
  ASSERT_GE(told.size(), 2u);
  EXPECT_LT(told.front().revision, told.back().revision);
  EXPECT_EQ(told.back().revision, map().revision());
  for (size_t i = 0; i < flight_.size(); ++i) {
    const Eigen::Vector3d found =
        LocalFromLocal(kOrigin, told.back().world.origin) *
        (told.back().world.local_from_world *
         map().At(visit_.keyframes[i]).cam_from_world.InverseTranslation());
    EXPECT_LT((found - flight_[i].InverseTranslation()).norm(), 0.5);
  }
}

}  // namespace
}  // namespace deepuav
