#include "deepuav/evaluation/measures/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/evaluation/report/evaluation_report.h"
#include "support/flights.h"

namespace deepuav {
namespace {

using testing::HasSubstr;
using testing::Property;
using testing::Throws;

const Sim3 kMoved(0.2, RotationExp({0.4, -0.3, 1.1}), {3, 2, -1});

TEST(Evaluation, CountsWhatIsMissing) {
  const Truth truth{MakeFlight(100, 20), true};
  Trajectory estimate = MoveTrajectory(kMoved, truth.trajectory);
  estimate.erase(estimate.begin(), estimate.begin() + 25);
  const Evaluation evaluation = EvaluateTrajectory(truth, estimate);
  EXPECT_EQ(evaluation.estimate_poses, 75);
  EXPECT_EQ(evaluation.matched_truth.size(), 75u);
  EXPECT_DOUBLE_EQ(evaluation.Completeness(), 0.75);
  EXPECT_LT(evaluation.ate.statistics_m.rmse, 1e-8);
  ASSERT_TRUE(evaluation.rpe.has_value());
  EXPECT_LT(evaluation.rpe->translation_m.rmse, 1e-8);
}

TEST(Evaluation, AlignsAgainWithinThePartAsked) {
  const Truth truth{MakeFlight(200, 20), true};
  Trajectory estimate = truth.trajectory;
  for (size_t i = 100; i < 200; ++i) {
    const SE3& pose = estimate[i].world_from_cam;
    estimate[i].world_from_cam =
        SE3(pose.rotation(), pose.translation() + Eigen::Vector3d(1, 0, 0));
  }
  EvaluationOptions options;
  EXPECT_GT(EvaluateTrajectory(truth, estimate, options).ate.statistics_m.rmse, 0.1);
  options.end_s = 4.9;
  const Evaluation first_half = EvaluateTrajectory(truth, estimate, options);
  EXPECT_EQ(first_half.matched_truth.size(), 99u);
  EXPECT_LT(first_half.ate.statistics_m.rmse, 1e-9);
}

TEST(Evaluation, HorizontalLeavesHeightOut) {
  const Truth truth{MakeFlight(200, 20), true};
  Trajectory estimate = truth.trajectory;
  for (size_t i = 0; i < estimate.size(); ++i) {
    const SE3& pose = estimate[i].world_from_cam;
    const double height_error = i % 2 == 0 ? 0.5 : -0.5;
    estimate[i].world_from_cam =
        SE3(pose.rotation(), pose.translation() + Eigen::Vector3d(0, 0, height_error));
  }
  EvaluationOptions options;
  options.alignment.reset();
  EXPECT_NEAR(EvaluateTrajectory(truth, estimate, options).ate.statistics_m.rmse, 0.5, 1e-9);
  options.horizontal = true;
  EXPECT_NEAR(EvaluateTrajectory(truth, estimate, options).ate.statistics_m.rmse, 0, 1e-12);
}

TEST(Evaluation, HorizontalIsTheRelativeErrorToo) {
  const Truth truth{MakeFlight(200, 20), true};
  Trajectory estimate = truth.trajectory;
  for (size_t i = 0; i < estimate.size(); ++i) {
    const SE3& pose = estimate[i].world_from_cam;
    const Eigen::Vector3d error_m(0, 0.1 * static_cast<double>(i), i % 2 == 0 ? 0.5 : -0.5);
    estimate[i].world_from_cam = SE3(pose.rotation(), pose.translation() + error_m);
  }
  EvaluationOptions options;
  options.alignment.reset();
  EXPECT_NEAR(EvaluateTrajectory(truth, estimate, options).rpe->translation_m.rmse,
              std::hypot(1, 0.1), 1e-9);
  options.horizontal = true;
  EXPECT_NEAR(EvaluateTrajectory(truth, estimate, options).rpe->translation_m.rmse, 0.1, 1e-9);
}

TEST(Evaluation, FixesHaveNoRotationError) {
  const Truth fixes{MakeFlight(50, 1), false};
  const Evaluation evaluation = EvaluateTrajectory(fixes, fixes.trajectory);
  ASSERT_TRUE(evaluation.rpe.has_value());
  EXPECT_FALSE(evaluation.rpe->rotation_deg.has_value());
}

TEST(Evaluation, NoCommonTimeNamesBothRanges) {
  const Truth truth{MakeFlight(50, 10), true};
  const Trajectory later = MakeFlight(50, 10, 1000);
  EXPECT_THAT([&] { EvaluateTrajectory(truth, later); },
              Throws<Error>(Property(&Error::what, AllOf(HasSubstr("0.000 to 4.900 s"),
                                                         HasSubstr("1000.000 to 1004.900 s")))));
}

TEST(Evaluation, TooFewPosesToAlignIsAnError) {
  const Truth truth{MakeFlight(50, 10), true};
  const Trajectory two(truth.trajectory.begin(), truth.trajectory.begin() + 2);
  EXPECT_THROW(EvaluateTrajectory(truth, two), Error);
}

TEST(EvaluationReport, JsonAndTableSayTheSame) {
  const Truth truth{MakeFlight(100, 20), true};
  Random random(3);
  const EvaluationOptions options;
  const Evaluation evaluation =
      EvaluateTrajectory(truth, AddNoise(truth.trajectory, 0.1, random), options);
  const nlohmann::json json = EvaluationJson(evaluation, options);
  EXPECT_DOUBLE_EQ(json["ate_m"]["rmse"], evaluation.ate.statistics_m.rmse);
  EXPECT_EQ(json["per_pose"]["error_m"].size(), 100u);
  const std::string rmse = fmt::format("{:.6f}", evaluation.ate.statistics_m.rmse);
  EXPECT_THAT(EvaluationTable(evaluation, options), HasSubstr(rmse));
}

TEST(EvaluationReport, NamesAreUnderstoodAndOthersRefused) {
  for (const char* name : {"sim3", "se3", "yaw", "none"}) {
    EXPECT_EQ(AlignmentName(ParseAlignment(name)), name);
  }
  for (const char* name : {"frames", "m", "s"}) EXPECT_EQ(RpeUnitName(ParseRpeUnit(name)), name);
  EXPECT_THROW(ParseAlignment("affine"), Error);
  EXPECT_THROW(ParseRpeUnit("furlongs"), Error);
}

}  // namespace
}  // namespace deepuav
