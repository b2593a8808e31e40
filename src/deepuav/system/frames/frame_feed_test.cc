#include "deepuav/system/frames/frame_feed.h"

#include <gtest/gtest.h>

#include "support/synthetic_flight.h"

namespace deepuav {
namespace {

/// Frames whose features have as many key points as their number.
std::vector<Features> CountingFeatures(int count) {
  std::vector<Features> features(static_cast<size_t>(count));
  for (size_t i = 0; i < features.size(); ++i) features[i].keypoints.resize(i);
  return features;
}

void ExpectFrames(FrameFeed* feed, int count) {
  for (int i = 0; i < count; ++i) {
    const std::optional<Frame> frame = feed->Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->id, FrameId{i});
    EXPECT_EQ(frame->time, Timestamp{i * 10'000'000});
    EXPECT_EQ(frame->features->size(), i);
  }
}

TEST(SequentialFeed, GivesEveryFrameWithItsFeatures) {
  const auto features = CountingFeatures(20);
  NumberedImages images(20, 0.01);
  PreparedFeatures extractor(features);
  StageClock clock;
  SequentialFeed feed(&images, &extractor, &clock);
  ExpectFrames(&feed, 20);
  EXPECT_FALSE(feed.Next());
  const auto durations = clock.Durations();
  EXPECT_EQ(durations.at("decode").size(), 20u);
  EXPECT_EQ(durations.at("network"), std::vector<double>(20, 0.002));
  EXPECT_EQ(durations.at("key points"), std::vector<double>(20, 0.001));
}

TEST(SequentialFeed, CorrectsKeyPointsForWhatTheGyroscopeSays) {
  Camera camera{640, 481, {400, 400, 320, 240}, LensModel::kPinhole, {}, 0};
  camera.readout_s = 0.02;
  ImuStream imu;
  for (int i = 0; i < 100; ++i)
    imu.samples.push_back({{50'000'000 + i * 5'000'000}, {0, 0.5, 0}, Eigen::Vector3d::Zero()});
  const CameraTurns turns(imu, 0.05, camera);
  std::vector<Features> features(2);
  for (Features& of : features) {
    for (float y : {0.f, 240.f, 480.f}) of.keypoints.push_back({{320, y}, {320, y}, 1, 1});
  }
  NumberedImages images(2, 0.1);
  PreparedFeatures extractor(features);
  StageClock clock;
  SequentialFeed feed(&images, &extractor, &clock, &turns);
  const auto uncovered = feed.Next(), covered = feed.Next();
  ASSERT_TRUE(uncovered && covered);
  EXPECT_FALSE(uncovered->turn_is_measured) << "it lies before the first sample";
  EXPECT_EQ(uncovered->features->keypoints[0].px.x(), 320);
  EXPECT_TRUE(covered->turn_is_measured);
  EXPECT_FALSE(uncovered->turn_since_before);
  EXPECT_FALSE(covered->turn_since_before) << "the samples begin after the image before";
  EXPECT_NEAR(covered->motion.turn_rad.y(), 0.01, 1e-12);
  // Turning to the right, the first row sees a thing further right than the middle one will.
  EXPECT_NEAR(covered->features->keypoints[0].px.x(), 320 - 400 * 0.005, 0.5);
  EXPECT_LT(covered->features->keypoints[0].px.x(), 319);
  EXPECT_EQ(covered->features->keypoints[1].px.x(), 320);
  EXPECT_GT(covered->features->keypoints[2].px.x(), 321);
  EXPECT_EQ(covered->features->keypoints[2].image_px.x(), 320);
}

TEST(SequentialFeed, SaysHowTheCameraTurnedSinceTheImageBefore) {
  ImuStream imu;
  for (int i = 0; i < 100; ++i)
    imu.samples.push_back({{i * 5'000'000}, {0, 0.5, 0}, Eigen::Vector3d::Zero()});
  const CameraTurns turns(imu, 0.05, Camera());
  NumberedImages images(3, 0.1);
  const auto features = CountingFeatures(3);
  PreparedFeatures extractor(features);
  StageClock clock;
  SequentialFeed feed(&images, &extractor, &clock, &turns);
  EXPECT_FALSE(feed.Next()->turn_since_before);
  for (int i = 1; i < 3; ++i) {
    const auto frame = feed.Next();
    ASSERT_TRUE(frame && frame->turn_since_before);
    EXPECT_NEAR(RotationLog(*frame->turn_since_before).y(), -0.05, 1e-9);
    EXPECT_FALSE(frame->turn_is_measured) << "within an image that is read at once";
  }
}

TEST(PrefetchingFeed, GivesTheSameFrames) {
  const auto features = CountingFeatures(50);
  for (int frames_ahead : {1, 3, 100}) {
    NumberedImages images(50, 0.01);
    PreparedFeatures extractor(features);
    StageClock clock;
    SequentialFeed sequential(&images, &extractor, &clock);
    PrefetchingFeed feed(&sequential, frames_ahead);
    ExpectFrames(&feed, 50);
    EXPECT_FALSE(feed.Next());
    EXPECT_FALSE(feed.Next());
  }
}

TEST(PrefetchingFeed, PassesOnWhatWasThrownAfterTheFramesBefore) {
  const auto features = CountingFeatures(10);
  NumberedImages images(10, 0.01, 6);
  PreparedFeatures extractor(features);
  StageClock clock;
  SequentialFeed sequential(&images, &extractor, &clock);
  PrefetchingFeed feed(&sequential, 2);
  ExpectFrames(&feed, 6);
  EXPECT_THROW(feed.Next(), std::runtime_error);
}

TEST(PrefetchingFeed, MayBeLeftBeforeTheEnd) {
  const auto features = CountingFeatures(200);
  for (int taken : {0, 1, 5}) {
    NumberedImages images(200, 0.01);
    PreparedFeatures extractor(features);
    StageClock clock;
    SequentialFeed sequential(&images, &extractor, &clock);
    PrefetchingFeed feed(&sequential, 2);
    ExpectFrames(&feed, taken);
  }
}

}  // namespace
}  // namespace deepuav
