#include "deepuav/assembly/datasets/soft_sample.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr int kWidth = 480, kHeight = 360;

/// Cards of many sizes, one upon the other.
cv::Mat1b Cards(uint64_t seed) {
  cv::Mat1b image(kHeight, kWidth, uint8_t{128});
  Random random(seed);
  for (int i = 0; i < 600; ++i) {
    const cv::Rect card(random.Index(kWidth), random.Index(kHeight), 4 + random.Index(40),
                        4 + random.Index(40));
    image(card & cv::Rect(0, 0, kWidth, kHeight)) = static_cast<uint8_t>(random.Index(256));
  }
  return image;
}

/// Out of focus, of little contrast.
cv::Mat1b Soft(const cv::Mat1b& image) {
  cv::Mat1b soft;
  cv::GaussianBlur(image, soft, {}, 3);
  return soft * 0.6 + 50;
}

class SoftSampleTest : public testing::Test {
 protected:
  SoftSampleTest() {
    options_.features.model = DEEPUAV_MODELS "/superpoint_small.onnx";
    options_.inference.precision = "fp32";
    std::filesystem::create_directories(folder_);
  }
  ~SoftSampleTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  void Write(int number, const cv::Mat1b& image) {
    cv::imwrite((folder_ / fmt::format("{:04}.png", number)).string(), image);
  }

  std::optional<double> Find(const FrameRange& range = {}) {
    const auto dataset = OpenDataset(folder_);
    return FindSoftPixels(options_, range, nullptr, dataset.get());
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) /
      fmt::format("{}_{}", testing::UnitTest::GetInstance()->current_test_info()->name(), getpid());
  RunOptions options_;
};

TEST_F(SoftSampleTest, SharpImagesAreSeenWhole) {
  for (int i = 0; i < 3; ++i) Write(i, Cards(i));
  EXPECT_FALSE(Find());
}

TEST_F(SoftSampleTest, SoftOnesAtAPartOfTheirPixels) {
  for (int i = 0; i < 8; ++i) Write(i, Soft(Cards(i)));
  const auto pixels = Find();
  ASSERT_TRUE(pixels);
  EXPECT_LE(*pixels, 0.5 * kWidth * kHeight);
  options_.features.reduce_soft = false;
  EXPECT_FALSE(Find());
}

TEST_F(SoftSampleTest, NobodyAsksTinyOnes) {
  Write(0, Cards(0)(cv::Rect(0, 0, 64, 48)));
  EXPECT_FALSE(Find());
}

TEST(SoftSampleFramesTest, LieAllOverTheRangeOrInTheFirstSecondsOfAVideo) {
  EXPECT_EQ(SoftSampleFrames({}, 600), (std::vector<int>{50, 150, 250, 350, 450, 550}));
  EXPECT_EQ(SoftSampleFrames({}, 6000, 10), (std::vector<int>{10, 30, 50, 70, 90, 110}));
  EXPECT_EQ(SoftSampleFrames({}, 60, 30), (std::vector<int>{5, 15, 25, 35, 45, 55}))
      << "of a short one all over it";
  EXPECT_EQ(SoftSampleFrames({7, 10, 1}, 60), (std::vector<int>{7, 8, 9}));
  EXPECT_EQ(SoftSampleFrames({59, -1, 1}, 60), (std::vector<int>{59}));
  for (const int frame : SoftSampleFrames({3, -1, 8}, 500, 30))
    EXPECT_EQ(frame % 8, 3) << "others are not run";
}

TEST_F(SoftSampleTest, OfTheRangeThatIsRunAndOfWhatCanBeRead) {
  for (int i = 0; i < 6; ++i) Write(i, Cards(i));
  for (int i = 6; i < 9; ++i) Write(i, Soft(Cards(i)));
  std::ofstream(folder_ / "0009.png") << "no picture";
  EXPECT_FALSE(Find({0, 6, 1}));
  EXPECT_TRUE(Find({6, -1, 1}));
  EXPECT_FALSE(Find({9, -1, 1}));
}

}  // namespace
}  // namespace deepuav
