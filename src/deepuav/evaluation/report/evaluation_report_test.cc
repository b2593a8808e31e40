#include "deepuav/evaluation/report/evaluation_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/flights.h"

namespace deepuav {
namespace {

using testing::HasSubstr;
using testing::Not;

const Truth kTruth{MakeFlight(50, 10), true};

std::string TableOf(const EvaluationOptions& options, const Truth& truth = kTruth,
                    const Trajectory& estimate = kTruth.trajectory) {
  return EvaluationTable(EvaluateTrajectory(truth, estimate, options), options);
}

TEST(EvaluationReport, TellsTheAlignmentSoThatItCanBeDoneAgain) {
  const Sim3 estimate_from_truth(0.5, RotationExp({0.1, 0.2, 0.3}), {4, 5, 6});
  const EvaluationOptions options;
  const nlohmann::json json = EvaluationJson(
      EvaluateTrajectory(kTruth, MoveTrajectory(estimate_from_truth, kTruth.trajectory), options),
      options);
  const nlohmann::json& told = json["alignment"];
  const auto q = told["rotation_wxyz"].get<std::vector<double>>();
  const auto t = told["translation_m"].get<std::vector<double>>();
  const Sim3 truth_from_estimate(told["scale"], Eigen::Quaterniond(q[0], q[1], q[2], q[3]),
                                 {t[0], t[1], t[2]});
  const Eigen::Vector3d point(1, -2, 3);
  EXPECT_LT((truth_from_estimate * (estimate_from_truth * point) - point).norm(), 1e-7);
  EXPECT_EQ(told["kind"], "sim3");
}

TEST(EvaluationReport, TimesAreWholeNanosecondsHoweverLate) {
  const Timestamp late{1'403'636'584'763'555'583};
  Truth truth = kTruth;
  for (TimedPose& pose : truth.trajectory) pose.time.nanoseconds += late.nanoseconds;
  const EvaluationOptions options;
  const nlohmann::json json =
      EvaluationJson(EvaluateTrajectory(truth, truth.trajectory, options), options);
  EXPECT_EQ(json["per_pose"]["truth_time_ns"][0], late.nanoseconds);
  EXPECT_EQ(nlohmann::json::parse(json.dump())["per_pose"]["truth_time_ns"][0], late.nanoseconds);
}

TEST(EvaluationReport, SaysWhereNoTwoPosesAreTheStepApart) {
  EvaluationOptions options;
  options.rpe.delta = 1000;
  EXPECT_THAT(TableOf(options), HasSubstr("no two poses are 1000 frames apart"));
  EXPECT_TRUE(EvaluationJson(EvaluateTrajectory(kTruth, kTruth.trajectory, options), options)["rpe"]
                  .is_null());
}

TEST(EvaluationReport, SaysWhatWasDoneWithTimesAndPoints) {
  EvaluationOptions options;
  EXPECT_THAT(TableOf(options), Not(HasSubstr("Time offset")));
  EXPECT_THAT(TableOf(options), Not(HasSubstr("interpolated")));
  options.association.time_offset_s = -0.25;
  options.association.interpolate = true;
  options.antenna_cam_m = Eigen::Vector3d(0.1, 0, -0.2);
  options.horizontal = true;
  const std::string table = TableOf(options);
  EXPECT_THAT(table, HasSubstr("Time offset -0.250000 s added to the estimate\n"));
  EXPECT_THAT(table, HasSubstr("is interpolated"));
  EXPECT_THAT(table, HasSubstr("point 0.100, 0.000, -0.200 m"));
  EXPECT_THAT(table, HasSubstr("ATE horizontal, m"));
}

TEST(EvaluationReport, TellsTheErrorAlongEachAxis) {
  EvaluationOptions options;
  options.alignment.reset();
  Truth truth = kTruth;
  const Trajectory shifted =
      MoveTrajectory(Sim3(1, Eigen::Quaterniond::Identity(), {3, 4, 12}), truth.trajectory);
  const auto json = [&] {
    return EvaluationJson(EvaluateTrajectory(truth, shifted, options),
                          options)["ate_rmse_along_axes_m"];
  };
  EXPECT_NEAR(json()[2], 12, 1e-9);
  EXPECT_THAT(TableOf(options, truth, shifted),
              HasSubstr("along x 3.000000, along y 4.000000, along z 12.000000 m\n"));
  truth.z_is_up = true;
  EXPECT_THAT(TableOf(options, truth, shifted), HasSubstr("along z (up) 12.000000 m\n"));
  options.horizontal = true;
  EXPECT_NEAR(json()[1], 4, 1e-9);
  EXPECT_TRUE(json()[2].is_null());
  EXPECT_THAT(TableOf(options, truth, shifted),
              HasSubstr("along x 3.000000, along y 4.000000 m\n"));
}

TEST(EvaluationReport, OfFixesComparesDistancesAndNoRotations) {
  const Truth fixes{kTruth.trajectory, false};
  const EvaluationOptions options;
  const nlohmann::json json =
      EvaluationJson(EvaluateTrajectory(fixes, fixes.trajectory, options), options);
  EXPECT_EQ(json["rpe"]["compares"], "distance");
  EXPECT_TRUE(json["rpe"]["rotation_deg"].is_null());
  EXPECT_THAT(TableOf(options, fixes), HasSubstr("RPE distance, m"));
  EXPECT_THAT(TableOf(options, fixes), Not(HasSubstr("RPE rotation")));
}

TEST(EvaluationReport, CountsPairsThatShareAPose) {
  Trajectory twice;
  for (size_t i = 0; i < 20; ++i) {
    const TimedPose& pose = kTruth.trajectory[i];
    for (const int64_t later_ns : {0, 1'000'000})
      twice.push_back({{pose.time.nanoseconds + later_ns}, pose.world_from_cam});
  }
  EXPECT_THAT(TableOf({}, kTruth, twice), HasSubstr("20 pairs share a pose with another pair"));
  EXPECT_THAT(TableOf({}), Not(HasSubstr("share a pose")));
}

}  // namespace
}  // namespace deepuav
