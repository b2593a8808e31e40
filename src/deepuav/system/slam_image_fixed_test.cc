#include <gtest/gtest.h>

#include "deepuav/system/slam.h"
#include "deepuav/system/testing/slam_runs.h"

namespace deepuav {
namespace {

constexpr int kFrames = 100, kWriting = 40;

Eigen::Vector2f WritingPlace(int i) {
  return {20.f + 14.f * static_cast<float>(i % 10), 20.f + 14.f * static_cast<float>(i / 10)};
}

/// Writing over the left upper corner: the same key points in every image.
SyntheticFlight FlightUnderWriting() {
  SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(kFrames), kNoise, 3);
  Random random(11);
  Features writing;
  writing.descriptors = Descriptors(flight.features[0].descriptors.dimension());
  for (int i = 0; i < kWriting; ++i) {
    writing.keypoints.push_back({WritingPlace(i), WritingPlace(i), 1, 1});
    std::vector<float> row(static_cast<size_t>(writing.descriptors.dimension()));
    Eigen::Map<Eigen::VectorXf> values(row.data(), std::ssize(row));
    for (float& value : row) value = static_cast<float>(random.Gaussian(1));
    values.normalize();
    writing.descriptors.Append(row);
  }
  for (Features& features : flight.features) {
    for (int i = 0; i < writing.size(); ++i) {
      features.keypoints.push_back(writing.keypoints[static_cast<size_t>(i)]);
      features.descriptors.AppendFrom(writing.descriptors, i);
    }
  }
  return flight;
}

TEST(SlamImageFixed, WritingOverTheImageIsLeftOut) {
  const SyntheticFlight flight = FlightUnderWriting();
  const Outcome run = Fly(flight);
  EXPECT_TRUE(run.result.image_fixed.Covers({20, 20}));
  EXPECT_LT(run.result.image_fixed.Share(), 0.1);
  EXPECT_GT(run.result.image_fixed_keypoint_share, 0.03);
  EXPECT_EQ(Located(run.result), kFrames);
  EXPECT_LT(PathError(run.result, flight), 0.05) << "over 15 m";
}

TEST(SlamImageFixed, WhatIsKnownBeforeIsLeftOutFromTheFirstImageOn) {
  const SyntheticFlight flight = FlightUnderWriting();
  const ImageRegion known = Fly(flight).result.image_fixed;
  PreparedFeatures extractor(flight.features);
  NearestNeighbourMatcher matcher({});
  NumberedImages images(flight.size(), flight.frame_interval_s);
  Slam slam(flight.camera, {}, Perception{&extractor, &matcher});
  slam.LeaveOut(known);
  const SlamResult result = slam.Run(&images, Schedule::kSequential);
  for (size_t i = 0; i < result.frames.size(); ++i)
    EXPECT_LE(result.frames[i].keypoint_count, flight.features[i].size() - 30) << i;
  EXPECT_EQ(Located(result), kFrames);
}

TEST(SlamImageFixed, ACleanImageKeepsAllItsKeyPoints) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(kFrames), kNoise, 3);
  const SlamResult result = Fly(flight).result;
  EXPECT_TRUE(result.image_fixed.empty());
  EXPECT_EQ(result.image_fixed_keypoint_share, 0);
  SystemOptions options;
  options.image_fixed.set_aside = false;
  EXPECT_EQ(Bytes(Fly(flight, Schedule::kSequential, options).result), Bytes(result));
}

TEST(SlamImageFixed, SequentialAndThreadedAgreeToTheByte) {
  const SyntheticFlight flight = FlightUnderWriting();
  EXPECT_EQ(Bytes(Fly(flight, Schedule::kThreaded).result), Bytes(Fly(flight).result));
}

}  // namespace
}  // namespace deepuav
