#include "deepuav/features/seen_size.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

TEST(SeenSize, LeavesImagesThatAreSmallEnough) {
  for (const double max_pixels : {0.0, 640.0 * 480}) {
    const SeenSize size(640, 480, max_pixels);
    EXPECT_EQ(size.width(), 640);
    EXPECT_EQ(size.height(), 480);
    const GreyImage image(480, 640, uint8_t{7});
    GreyImage buffer;
    EXPECT_EQ(&size.Reduce(image, &buffer), &image);
    EXPECT_TRUE(buffer.empty());
    // To the bit: what is not reduced must not change.
    for (const float at : {0.0f, 0.1f, 123.456f, 479.0f}) {
      const Eigen::Vector2f px(at, at);
      EXPECT_EQ(size.ToNetwork(px), px);
      EXPECT_EQ(size.ToImage(px), px);
    }
    EXPECT_EQ(size.PixelLength(), 1);
  }
}

TEST(SeenSize, ReducesToAboutSoManyPixelsInWholeCells) {
  for (const auto& [width, height] : {std::pair{752, 480}, {1226, 370}, {480, 752}, {401, 977}}) {
    const SeenSize size(width, height, 150'000);
    EXPECT_NEAR(size.width() * size.height(), 150'000, 7'500);
    EXPECT_EQ(size.width() % 8, 0);
    EXPECT_EQ(size.height() % 8, 0);
    EXPECT_NEAR(double(size.width()) / size.height(), double(width) / height,
                0.05 * width / height);
    EXPECT_NEAR(size.PixelLength(), std::sqrt(width * height / 150'000.0), 0.05);
  }
}

TEST(SeenSize, OfATinyImageIsACellOrTheImage) {
  const SeenSize cell(100, 9, 1);
  EXPECT_EQ(cell.width(), 8);
  EXPECT_EQ(cell.height(), 8);
  const SeenSize narrow(100, 5, 100);
  EXPECT_EQ(narrow.height(), 5) << "never enlarged";
}

TEST(SeenSize, FindsThePlaceOfAPixelInTheReducedImage) {
  const SeenSize size(752, 480, 90'000);
  GreyImage image(480, 752, uint8_t{0}), buffer;
  image(cv::Rect(300, 200, 8, 8)) = 255;
  const GreyImage& reduced = size.Reduce(image, &buffer);
  ASSERT_EQ(reduced.size(), cv::Size(size.width(), size.height()));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weights = 0;
  for (int y = 0; y < reduced.rows; ++y) {
    for (int x = 0; x < reduced.cols; ++x) {
      sum += reduced(y, x) * Eigen::Vector2d(x, y);
      weights += reduced(y, x);
    }
  }
  const Eigen::Vector2f centre = (sum / weights).cast<float>(), truth(303.5f, 203.5f);
  EXPECT_LT((size.ToImage(centre) - truth).norm(), 0.05);
  EXPECT_LT((size.ToNetwork(truth) - centre).norm(), 0.05);
  EXPECT_LT((size.ToImage(size.ToNetwork(truth)) - truth).norm(), 1e-4);
}

TEST(SeenSize, RefusesAnImageOfAnotherSize) {
  GreyImage buffer;
  EXPECT_THROW(SeenSize(64, 48).Reduce(GreyImage(47, 64), &buffer), Error);
  EXPECT_THROW(SeenSize(640, 480, 10'000).Reduce(GreyImage(480, 639), &buffer), Error);
}

}  // namespace
}  // namespace deepuav
