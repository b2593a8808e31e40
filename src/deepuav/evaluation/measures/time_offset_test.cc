#include "deepuav/evaluation/measures/time_offset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/evaluation/report/evaluation_report.h"
#include "deepuav/sensors/lever_arm.h"
#include "support/flights.h"

namespace deepuav {
namespace {

using testing::HasSubstr;
using testing::Property;
using testing::Throws;

const Sim3 kMoved(0.2, RotationExp({0.4, -0.3, 1.1}), {3, 2, -1});
const Eigen::Vector3d kAntenna(0.1, -0.4, 0.2);

/// The antenna's path as a receiver of 5 Hz gives it, without orientation.
Truth Receiver(double sigma_m, uint64_t seed) {
  Random random(seed);
  const Trajectory path = MoveToAntenna(Sim3(), MakeFlight(300, 5), kAntenna);
  Truth truth{.trajectory = AddNoise(path, sigma_m, random)};
  truth.has_orientation = false;
  truth.has_own_clock = true;
  truth.antenna_cam_m = kAntenna;
  return truth;
}

/// The camera at 20 Hz, in another world and scale, its clock `late_s` behind the truth's.
Trajectory Camera(double late_s) { return MoveTrajectory(kMoved, MakeFlight(1200, 20, -late_s)); }

Trajectory EveryNth(const Trajectory& flight, size_t n) {
  Trajectory chosen;
  for (size_t i = 0; i < flight.size(); i += n) chosen.push_back(flight[i]);
  return chosen;
}

EvaluationOptions Searching(double range_s) {
  EvaluationOptions options;
  options.search_offset_s = range_s;
  return options;
}

/// A flight whose stamps are later by `delay_s` than its motion.
Trajectory Delayed(const Trajectory& flight, double delay_s) {
  Trajectory delayed = flight;
  for (TimedPose& pose : delayed) pose.time.nanoseconds += AtSeconds(delay_s).nanoseconds;
  return delayed;
}

TEST(TimeOffset, OfAVideoToUnixTimeIsFoundAsExactly) {
  constexpr double kStart_s = 1.7e9;
  EvaluationOptions options = Searching(5);
  options.association.time_offset_s = kStart_s;
  const Trajectory truth_path = Receiver(0, 1).trajectory;
  Truth truth = Receiver(0, 1);
  truth.trajectory = Delayed(truth_path, kStart_s);
  const double found = SearchTimeOffset(truth, Delayed(Camera(0), -0.0173), options);
  EXPECT_NEAR(found - kStart_s, 0.0173, 2e-4);
}

TEST(TimeOffset, IsFoundToAFractionOfTheFrameInterval) {
  for (const double offset_s : {-3.1234, -0.011, 0.0, 0.0173, 2.718}) {
    const Trajectory estimate = Delayed(Camera(0), -offset_s);
    const double found = SearchTimeOffset(Receiver(0, 1), estimate, Searching(5));
    // What is left is the linear interpolation between poses 50 ms apart.
    EXPECT_NEAR(found, offset_s, 2e-4);
  }
}

TEST(TimeOffset, NoiseOfMetresStillGivesHundredths) {
  // 300 fixes of 0.5 m at about 3 m/s allow 0.5 / 3 / sqrt(300) = 0.01 s.
  const Trajectory estimate = Delayed(Camera(0), -0.75);
  EXPECT_NEAR(SearchTimeOffset(Receiver(0.5, 2), estimate, Searching(2)), 0.75, 0.03);
}

TEST(TimeOffset, IsNotWhereTheReceiverRested) {
  constexpr double kRest_s = 120;
  Truth truth = Receiver(0.5, 6);
  const Trajectory flight = Delayed(truth.trajectory, kRest_s);
  Random random(7);
  const TimedPose start = flight.front();
  truth.trajectory.clear();
  for (int i = 0; i < 5 * kRest_s; ++i)
    truth.trajectory.push_back({AtSeconds(i / 5.0), start.world_from_cam});
  truth.trajectory = AddNoise(truth.trajectory, 0.3, random);
  truth.trajectory.insert(truth.trajectory.end(), flight.begin(), flight.end());
  EvaluationOptions options = Searching(80);
  options.association.time_offset_s = 60;
  EXPECT_NEAR(SearchTimeOffset(truth, Camera(0), options), kRest_s, 0.05);
}

TEST(TimeOffset, EvaluationUsesAndReportsIt) {
  const Trajectory estimate = Delayed(Camera(0), -1.2345);
  const Truth truth = Receiver(0, 3);
  EXPECT_GT(EvaluateTrajectory(truth, estimate).ate.statistics_m.rmse, 0.5);
  const Evaluation evaluation = EvaluateTrajectory(truth, estimate, Searching(3));
  EXPECT_NEAR(evaluation.time_offset_s, 1.2345, 2e-4);
  EXPECT_LT(evaluation.ate.statistics_m.rmse, 2e-3);
  EXPECT_NEAR(evaluation.ate.truth_from_estimate.scale() * kMoved.scale(), 1, 1e-3);
  EXPECT_TRUE(evaluation.interpolated);
  EXPECT_THAT(EvaluationTable(evaluation, Searching(3)), HasSubstr("as found"));
  EXPECT_NEAR(EvaluationJson(evaluation, Searching(3))["time_offset_s"], 1.2345, 2e-4);
}

TEST(TimeOffset, SearchesAroundTheOffsetGiven) {
  EvaluationOptions options = Searching(0.5);
  options.association.time_offset_s = 10;
  EXPECT_NEAR(SearchTimeOffset(Receiver(0, 4), Delayed(Camera(0), -10.2), options), 10.2, 2e-4);
}

TEST(TimeOffset, IsFoundInARangeThatIsMuchLongerThanTheFlight) {
  for (const double range_s : {200.0, 1e6, 1e9}) {
    EXPECT_NEAR(SearchTimeOffset(Receiver(0, 4), Camera(0), Searching(range_s)), 0, 2e-4);
    EXPECT_NEAR(SearchTimeOffset(Receiver(0, 4), Delayed(Camera(0), -3.2), Searching(range_s)), 3.2,
                2e-4);
  }
  const Trajectory old = Delayed(Camera(0), -1.5e6);
  EXPECT_NEAR(SearchTimeOffset(Receiver(0, 4), old, Searching(1e7)), 1.5e6, 2e-4);
}

TEST(TimeOffset, BeyondTheRangeIsAnError) {
  EXPECT_THAT([] { SearchTimeOffset(Receiver(0, 5), Delayed(Camera(0), -3), Searching(1)); },
              Throws<Error>(Property(&Error::what, HasSubstr("end of the range"))));
  EXPECT_THROW(SearchTimeOffset(Receiver(0, 5), Delayed(Camera(0), 1e4), Searching(1)), Error);
}

TEST(Interpolation, OfPhotographsSecondsApartIsAtTheirMoments) {
  const Trajectory photographs = EveryNth(Camera(0), 60);
  Truth denser;
  denser.trajectory = Camera(0);
  denser.has_own_clock = true;
  const Evaluation evaluation = EvaluateTrajectory(denser, photographs);
  EXPECT_TRUE(evaluation.truth_is_interpolated);
  EXPECT_EQ(evaluation.matched_estimate.size(), photographs.size());
  EXPECT_LT(evaluation.ate.statistics_m.max, 1e-6);
  EXPECT_GT(evaluation.Completeness(), 0.9);
  EXPECT_THAT(EvaluationTable(evaluation, {}), HasSubstr("truth is interpolated"));
}

TEST(Interpolation, CompletenessLeavesOutGapsOfRarePoses) {
  Truth denser;
  denser.trajectory = Camera(0);
  denser.has_own_clock = true;
  Trajectory photographs = EveryNth(Camera(0), 20);
  const double whole = EvaluateTrajectory(denser, photographs).Completeness();
  const auto third = std::ssize(photographs) / 3;
  photographs.erase(photographs.begin() + third, photographs.begin() + 2 * third);
  const double with_gap = EvaluateTrajectory(denser, photographs).Completeness();
  EXPECT_NEAR(with_gap, whole * 2 / 3, 0.05);
}

TEST(Interpolation, MeetsTheTruthBetweenThePosesAndLeavesGapsOut) {
  Trajectory estimate = MakeFlight(200, 20);
  const Trajectory truth = EveryNth(MakeFlight(10000, 1000), 187);
  const InterpolatedPairs whole = InterpolateDenser(truth, estimate);
  ASSERT_GT(whole.truth.size(), 45u);
  for (size_t i = 0; i < whole.truth.size(); ++i) {
    const SE3 difference =
        whole.truth[i].world_from_cam.Inverse() * whole.estimate[i].world_from_cam;
    EXPECT_LT(difference.translation().norm(), 2e-3);
    EXPECT_LT(difference.Angle(), 1e-3);
  }
  estimate.erase(estimate.begin() + 60, estimate.begin() + 100);
  for (const TimedPose& pose : InterpolateDenser(truth, estimate).estimate) {
    EXPECT_FALSE(pose.time > AtSeconds(2.96) && pose.time < AtSeconds(4.99));
  }
  EXPECT_THROW(InterpolateDenser(MakeFlight(10, 5, 1000), estimate), Error);
}

}  // namespace
}  // namespace deepuav
