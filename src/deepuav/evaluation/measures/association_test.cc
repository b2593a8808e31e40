#include "deepuav/evaluation/measures/association.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "support/flights.h"

namespace deepuav {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Trajectory At(const std::vector<double>& stamps_s) {
  Trajectory trajectory;
  for (const double stamp_s : stamps_s) trajectory.push_back({AtSeconds(stamp_s), SE3()});
  return trajectory;
}

std::string ErrorOf(const Trajectory& truth, const Trajectory& estimate,
                    const AssociationOptions& options = {}) {
  try {
    Associate(truth, estimate, options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Association, EqualStampsPairUp) {
  const Trajectory flight = MakeFlight(100, 20, 1403636584.76);
  const std::vector<AssociatedPair> pairs = Associate(flight, flight);
  ASSERT_EQ(pairs.size(), flight.size());
  for (int i = 0; i < 100; ++i) EXPECT_EQ(pairs[i], (AssociatedPair{i, i}));
}

TEST(Association, JitterBelowTheLimitKeepsThePairs) {
  const Trajectory truth = MakeFlight(200, 20);
  Trajectory estimate = truth;
  Random random(3);
  for (TimedPose& pose : estimate) {
    pose.time.nanoseconds += static_cast<int64_t>(random.Uniform(-9e6, 9e6));
  }
  const std::vector<AssociatedPair> pairs = Associate(truth, estimate);
  ASSERT_EQ(pairs.size(), truth.size());
  for (int i = 0; i < 200; ++i) EXPECT_EQ(pairs[i], (AssociatedPair{i, i}));
}

TEST(Association, TheLimitItselfIsAccepted) {
  const Trajectory truth = At({1, 2, 3});
  EXPECT_THAT(Associate(truth, At({1.01, 2.0100001, 2.99})),
              ElementsAre(AssociatedPair{0, 0}, AssociatedPair{2, 2}));
}

TEST(Association, TakesTheNearestOfSeveralAndTheEarlierOfTwoAsNear) {
  AssociationOptions options;
  options.max_difference_s = 1;
  EXPECT_THAT(Associate(At({0, 0.4, 1, 2}), At({0.5, 1.5}), options),
              ElementsAre(AssociatedPair{1, 0}, AssociatedPair{2, 1}));
}

TEST(Association, TheShorterTrajectoryLooksForPartners) {
  AssociationOptions options;
  options.max_difference_s = 0.2;
  const Trajectory dense = At({0, 0.1, 0.2, 1, 1.1, 1.2}), sparse = At({0.11, 1.11});
  EXPECT_THAT(Associate(dense, sparse, options),
              ElementsAre(AssociatedPair{1, 0}, AssociatedPair{4, 1}));
  EXPECT_THAT(Associate(sparse, dense, options),
              ElementsAre(AssociatedPair{0, 1}, AssociatedPair{1, 4}));
}

TEST(Association, OffsetIsAddedToTheEstimate) {
  const Trajectory truth = At({10, 11, 12}), estimate = At({7.5, 8.5, 9.5});
  AssociationOptions options;
  options.time_offset_s = 2.5;
  EXPECT_EQ(Associate(truth, estimate, options).size(), 3u);
  options.time_offset_s = -2.5;
  EXPECT_THROW(Associate(truth, estimate, options), Error);
}

TEST(Association, OffsetIsExactForLongNanosecondStamps) {
  Trajectory truth, estimate;
  for (int i = 0; i < 10; ++i) {
    truth.push_back({{1403636584763555584 + i * 50000000}, SE3()});
    estimate.push_back({{1403636584763555584 + i * 50000000 - 250000001}, SE3()});
  }
  AssociationOptions options;
  options.time_offset_s = 0.250000001;
  options.max_difference_s = 0;
  EXPECT_EQ(Associate(truth, estimate, options).size(), 10u);
}

TEST(Association, SharedPosesAreCountedAndDroppedOnDemand) {
  AssociationOptions options;
  options.max_difference_s = 0.1;
  const Trajectory truth = At({1.00, 1.05, 1.12, 3}), estimate = At({1.06, 2, 3, 4, 5});
  const std::vector<AssociatedPair> pairs = Associate(truth, estimate, options);
  EXPECT_THAT(pairs, ElementsAre(AssociatedPair{0, 0}, AssociatedPair{1, 0}, AssociatedPair{2, 0},
                                 AssociatedPair{3, 2}));
  EXPECT_EQ(CountSharedPoses(pairs), 2);

  options.one_to_one = true;
  const std::vector<AssociatedPair> unique = Associate(truth, estimate, options);
  EXPECT_THAT(unique, ElementsAre(AssociatedPair{1, 0}, AssociatedPair{3, 2}));
  EXPECT_EQ(CountSharedPoses(unique), 0);
}

TEST(Association, EqualStampsInOneTrajectoryAreNoError) {
  AssociationOptions options;
  options.one_to_one = true;
  const std::vector<AssociatedPair> pairs =
      Associate(At({1, 2, 2, 2, 3, 4}), At({1, 2, 3}), options);
  EXPECT_THAT(pairs, ElementsAre(AssociatedPair{0, 0}, AssociatedPair{3, 1}, AssociatedPair{4, 2}));
}

TEST(Association, NoOverlapNamesBothRanges) {
  EXPECT_THAT(
      ErrorOf(At({100, 101.5}), At({5, 6.25})),
      AllOf(HasSubstr("100.000 to 101.500 s"), HasSubstr("5.000 to 6.250 s"), HasSubstr("0.01 s")));
  EXPECT_THAT(ErrorOf(At({100, 101.5}), {}), HasSubstr("no poses"));
  EXPECT_THAT(ErrorOf({}, {}), HasSubstr("no poses"));
}

TEST(Association, WrongOptionsAreRefused) {
  AssociationOptions options;
  options.max_difference_s = -0.1;
  EXPECT_THAT(ErrorOf(At({1}), At({1}), options), HasSubstr("max_difference_s"));
  options = {};
  options.time_offset_s = NAN;
  EXPECT_THAT(ErrorOf(At({1}), At({1}), options), HasSubstr("time_offset_s"));
  EXPECT_THAT(ErrorOf(At({1}), At({1})), IsEmpty());
}

}  // namespace
}  // namespace deepuav
