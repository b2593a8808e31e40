#include "deepuav/features/superpoint_turned.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/features/superpoint.h"
#include "deepuav/features/testing/toy_superpoint.h"

namespace deepuav {
namespace {

GreyImage Turned(const GreyImage& image, int quarter_turns) {
  GreyImage turned = image.clone();
  for (int i = 0; i < quarter_turns; ++i) {
    GreyImage next;
    cv::rotate(turned, next, cv::ROTATE_90_CLOCKWISE);
    turned = next;
  }
  return turned;
}

GreyImage Noise(int width, int height) {
  GreyImage image(height, width);
  Random random(5);
  for (uint8_t& pixel : image) pixel = static_cast<uint8_t>(random.Index(256));
  return image;
}

/// The least similarity of what SuperPoint finds on the turned image and what SuperPointTurned says
/// of the same points of the image itself.
double LeastAgreement(const GreyImage& image, int quarter_turns, const SuperPointOptions& options) {
  const GreyImage turned = Turned(image, quarter_turns);
  const Features found =
      SuperPoint(PinholeCamera(turned.cols, turned.rows), options, Fp32()).Extract(turned);
  EXPECT_GT(found.size(), 20);
  Features upright = found;
  for (Keypoint& keypoint : upright.keypoints) {
    keypoint.image_px = TurnPixel(keypoint.image_px, 4 - quarter_turns, turned.cols, turned.rows);
  }
  SuperPointTurned describer({image.cols, image.rows, options.network_pixels}, options.model,
                             Fp32());
  const Descriptors described =
      describer.Describe(image, upright)[static_cast<size_t>(quarter_turns - 1)];
  EXPECT_EQ(described.size(), found.size());
  EXPECT_EQ(described.dimension(), found.descriptors.dimension());
  double least = 1;
  for (int i = 0; i < found.size(); ++i) {
    least = std::min<double>(least, described.Similarity(i, found.descriptors, i));
  }
  return least;
}

class SuperPointToyTurned : public testing::Test {
 protected:
  SuperPointOptions Options() {
    SuperPointOptions options;
    options.model = WriteToyNetwork(testing::TempDir(), "scores");
    options.border = 0;
    return options;
  }
};

TEST(TurnPixel, FollowsThePixelsOfATurnedImage) {
  for (const cv::Point dot : {cv::Point(0, 0), {12, 3}, {16, 10}}) {
    GreyImage image(11, 17, uint8_t{0});
    image(dot) = 255;
    for (int quarter_turns = 0; quarter_turns < 4; ++quarter_turns) {
      const Eigen::Vector2f px =
          TurnPixel(Eigen::Vector2i(dot.x, dot.y).cast<float>(), quarter_turns, 17, 11);
      const cv::Point expected(static_cast<int>(px.x()), static_cast<int>(px.y()));
      EXPECT_EQ(Turned(image, quarter_turns)(expected), 255) << dot << " " << quarter_turns;
    }
  }
}

TEST_F(SuperPointToyTurned, AgreesWithWhatIsFoundOnTheTurnedImage) {
  for (const auto& [width, height] : {std::pair{56, 40}, {53, 37}, {49, 62}}) {
    const GreyImage image = Noise(width, height);
    for (int quarter_turns = 1; quarter_turns < 4; ++quarter_turns) {
      EXPECT_GT(LeastAgreement(image, quarter_turns, Options()), 0.99)
          << width << "x" << height << " turned " << quarter_turns;
    }
  }
}

TEST_F(SuperPointToyTurned, AgreesWhereImagesAreReduced) {
  // Of twice the size on each axis, and not quite.
  for (const auto& [width, height] : {std::pair{256, 192}, {261, 187}}) {
    SuperPointOptions options = Options();
    options.network_pixels = 12'288;
    GreyImage image;
    cv::resize(Noise(128, 96), image, {width, height}, 0, 0, cv::INTER_CUBIC);
    for (int quarter_turns = 1; quarter_turns < 4; ++quarter_turns)
      EXPECT_GT(LeastAgreement(image, quarter_turns, options), 0.99) << quarter_turns;
  }
}

TEST_F(SuperPointToyTurned, DiffersFromTheUprightDescriptors) {
  const GreyImage image = Noise(64, 48);
  const Features features = SuperPoint(PinholeCamera(64, 48), Options(), Fp32()).Extract(image);
  const TurnedDescriptors turned =
      SuperPointTurned({64, 48}, Options().model, Fp32()).Describe(image, features);
  for (const Descriptors& descriptors : turned) {
    double sum = 0;
    for (int i = 0; i < features.size(); ++i)
      sum += descriptors.Similarity(i, features.descriptors, i);
    EXPECT_LT(sum / features.size(), 0.9);
  }
}

TEST_F(SuperPointToyTurned, NothingToDescribeGivesNothing) {
  SuperPointTurned describer({53, 37}, Options().model, Fp32());
  for (const Descriptors& descriptors :
       describer.Describe(Noise(53, 37), Features{{}, Descriptors(64)})) {
    EXPECT_EQ(descriptors.size(), 0);
    EXPECT_EQ(descriptors.dimension(), 64);
  }
}

TEST_F(SuperPointToyTurned, OtherSizesOfImagesAreRefused) {
  SuperPointTurned describer({64, 48}, Options().model, Fp32());
  try {
    describer.Describe(Noise(48, 64), Features{{}, Descriptors()});
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("48x64"));
    EXPECT_THAT(error.what(), testing::HasSubstr("64x48"));
  }
}

/// Of a frame of EuRoC, also cut to a size that is no multiple of 8.
TEST(SuperPointRealTurned, AgreesWithWhatIsFoundOnTheTurnedImage) {
  const char* shared = std::getenv("DEEPUAV_SHARED");
  if (!shared) GTEST_SKIP() << "DEEPUAV_SHARED is not set";
  SuperPointOptions options;
  options.model = std::filesystem::path(shared) / "models" / "superpoint_coco.onnx";
  options.keypoints = 200;
  const auto folder = std::filesystem::path(shared) / "data/euroc_mh01_excerpt/mav0/cam0/data";
  const std::vector<std::filesystem::path> files(std::filesystem::directory_iterator(folder), {});
  const GreyImage frame = LoadGrey(*std::min_element(files.begin(), files.end()));
  for (const cv::Size size : {cv::Size(384, 320), cv::Size(381, 317)}) {
    const GreyImage image = frame(cv::Rect({200, 100}, size)).clone();
    for (int quarter_turns = 1; quarter_turns < 4; ++quarter_turns) {
      const double least = LeastAgreement(image, quarter_turns, options);
      EXPECT_GT(least, 0.99) << size << " turned " << quarter_turns;
      RecordProperty(fmt::format("{}x{}_{}", size.width, size.height, quarter_turns),
                     fmt::format("{:.5f}", least));
    }
  }
}

}  // namespace
}  // namespace deepuav
