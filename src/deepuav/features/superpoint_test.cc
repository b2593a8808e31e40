#include "deepuav/features/superpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "deepuav/base/error.h"
#include "deepuav/features/testing/toy_superpoint.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

class SuperPointToy : public testing::Test {
 protected:
  SuperPointOptions Options(const std::string& detector) {
    SuperPointOptions options;
    options.model = WriteToyNetwork(testing::TempDir(), detector);
    options.threshold = detector == "scores" ? 0.3 : 0.03;
    options.subpixel = false;
    return options;
  }
};

/// Dots on black, of no symmetry that would hide swapped axes.
GreyImage Dots(int width, int height, const std::vector<cv::Point>& dots) {
  GreyImage image(height, width, uint8_t{0});
  for (const cv::Point& dot : dots) image(dot) = 255;
  return image;
}

void ExpectKeypointsAt(const Features& features, std::vector<cv::Point> expected) {
  ASSERT_EQ(features.keypoints.size(), expected.size());
  ASSERT_EQ(features.descriptors.size(), features.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    const auto& px = features.keypoints[i].image_px;
    EXPECT_EQ(cv::Point(static_cast<int>(px.x()), static_cast<int>(px.y())), expected[i]);
  }
}

TEST_F(SuperPointToy, ReadsBothLayoutsAtAnySize) {
  const std::vector<cv::Point> dots{
      {30, 5}, {13, 21}, {40, 30}};  // by row-major index, as equal scores are ordered
  for (const char* detector : {"scores", "logits"}) {
    for (const auto& [width, height] : {std::pair{56, 40}, {53, 37}, {49, 36}}) {
      SuperPoint extractor(PinholeCamera(width, height), Options(detector), Fp32());
      ExtractionTimes times;
      const Features features = extractor.Extract(Dots(width, height, dots), &times);
      ExpectKeypointsAt(features, dots);
      for (const Keypoint& keypoint : features.keypoints) {
        EXPECT_NEAR((keypoint.px - keypoint.image_px).norm(), 0, 1e-4);
        EXPECT_NEAR(keypoint.sigma_px, 1, 1e-4);
      }
      EXPECT_EQ(features.descriptors.dimension(), 64);
      EXPECT_GT(times.network_s, 0);
      EXPECT_GT(times.postprocessing_s, 0);
    }
  }
}

TEST_F(SuperPointToy, GivesNoKeypointsInTheBorderOrWhatWasAdded) {
  // Size 53: the image's last column is repeated up to 56, and would be detected there.
  SuperPointOptions options = Options("scores");
  options.border = 0;
  const Features to_the_edge = SuperPoint(PinholeCamera(53, 40), options, Fp32())
                                   .Extract(Dots(53, 40, {{52, 20}, {10, 30}}));
  ExpectKeypointsAt(to_the_edge, {{52, 20}, {10, 30}});
  options.border = 4;
  const Features inside = SuperPoint(PinholeCamera(53, 40), options, Fp32())
                              .Extract(Dots(53, 40, {{52, 20}, {49, 5}, {48, 30}}));
  ExpectKeypointsAt(inside, {{48, 30}});
}

TEST_F(SuperPointToy, FindsInAReducedImageWhereItIsInTheImage) {
  GreyImage image = Dots(256, 192, {});
  image(cv::Rect(40, 20, 2, 2)) = 255;
  image(cv::Rect(200, 150, 2, 2)) = 255;
  SuperPointOptions options = Options("scores");
  options.network_pixels = 128 * 96;
  SuperPoint extractor(PinholeCamera(256, 192), options, Fp32());
  EXPECT_TRUE(extractor.Description().ends_with(" at 128x96")) << "other maps see otherwise";
  const Features features = extractor.Extract(image);
  ASSERT_EQ(features.size(), 2);
  EXPECT_EQ(features.keypoints[0].image_px, Eigen::Vector2f(40.5f, 20.5f));
  EXPECT_EQ(features.keypoints[1].image_px, Eigen::Vector2f(200.5f, 150.5f));
  for (const Keypoint& keypoint : features.keypoints) {
    EXPECT_NEAR((keypoint.px - keypoint.image_px).norm(), 0, 1e-4);
    EXPECT_NEAR(keypoint.sigma_px, 2, 1e-3) << "in pixels of the image";
  }
}

TEST_F(SuperPointToy, SeesPhotographsWhole) {
  SuperPointOptions options = Options("scores");
  options.network_pixels = 128 * 96;
  SuperPoint extractor(PinholeCamera(256, 192), options.OfPhotographs(), Fp32());
  EXPECT_EQ(extractor.Description().find(" at "), std::string::npos);
  const Features features = extractor.Extract(Dots(256, 192, {{41, 21}, {200, 150}}));
  ExpectKeypointsAt(features, {{41, 21}, {200, 150}});
  EXPECT_NEAR(features.keypoints[0].sigma_px, 1, 1e-3);
  options.photograph_pixels = 64 * 48;
  EXPECT_EQ(options.OfPhotographs().network_pixels, 64 * 48);
}

TEST(SuperPointOptions, ALimitOfPixelsLeavesWhatIsFewer) {
  SuperPointOptions options;
  options.network_pixels = 100'000;
  options.photograph_pixels = 0;
  options.LimitPixels(200'000);
  EXPECT_EQ(options.network_pixels, 100'000);
  EXPECT_EQ(options.photograph_pixels, 200'000);
  EXPECT_EQ(options.OfPhotographs().network_pixels, 200'000);
  options.LimitPixels(50'000);
  EXPECT_EQ(options.network_pixels, 50'000);
  EXPECT_EQ(options.photograph_pixels, 50'000);
}

TEST_F(SuperPointToy, KeepsTheBest) {
  GreyImage image = Dots(64, 64, {});
  image(10, 10) = 150;
  image(30, 30) = 250;
  image(50, 20) = 200;
  SuperPointOptions options = Options("scores");
  options.keypoints = 2;
  ExpectKeypointsAt(SuperPoint(PinholeCamera(64, 64), options, Fp32()).Extract(image),
                    {{30, 30}, {20, 50}});
}

TEST_F(SuperPointToy, NothingFoundGivesNoFeatures) {
  SuperPoint extractor(PinholeCamera(64, 64), Options("scores"), Fp32());
  EXPECT_EQ(extractor.Extract(Dots(64, 64, {})).size(), 0);
}

TEST_F(SuperPointToy, UndistortsKeypointsAndTheirUncertainty) {
  Camera camera = PinholeCamera(400, 300);
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {-0.2, 0.03, 0, 0};
  SuperPoint extractor(camera, Options("scores"), Fp32());
  const Features features = extractor.Extract(Dots(400, 300, {{20, 20}, {200, 150}}));
  ASSERT_EQ(features.size(), 2);
  const Keypoint &corner = features.keypoints[0], &centre = features.keypoints[1];
  EXPECT_LT(corner.px.x(), 20);
  EXPECT_LT(corner.px.y(), 20);
  EXPECT_NEAR((centre.px - centre.image_px).norm(), 0, 0.01);
  EXPECT_NEAR(centre.sigma_px, 1, 0.001);

  const auto moved = [&](double dx, double dy) {
    return *camera.Undistort(corner.image_px.cast<double>() + Eigen::Vector2d(dx, dy));
  };
  const Eigen::Vector2d along_x = moved(0.01, 0) - moved(-0.01, 0),
                        along_y = moved(0, 0.01) - moved(0, -0.01);
  const double area =
      std::abs(along_x.x() * along_y.y() - along_x.y() * along_y.x()) / (0.02 * 0.02);
  EXPECT_GT(area, 1.1);
  EXPECT_NEAR(corner.sigma_px, std::sqrt(area), 1e-3);
}

TEST_F(SuperPointToy, OtherSizesOfImagesAreRefused) {
  SuperPoint extractor(PinholeCamera(64, 64), Options("scores"), Fp32());
  try {
    extractor.Extract(Dots(72, 64, {}));
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("72x64"));
    EXPECT_THAT(error.what(), HasSubstr("64x64"));
  }
}

TEST_F(SuperPointToy, OtherNetworksAreRefused) {
  try {
    SuperPoint(PinholeCamera(64, 48), Options("nothing"), Fp32());
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("superpoint_toy_nothing.xml"));
    EXPECT_THAT(error.what(), HasSubstr("desc[1,64,6,8]"));
    EXPECT_THAT(error.what(), HasSubstr("[1,65,6,8]"));
  }
}

TEST_F(SuperPointToy, DescriptionNamesTheWeights) {
  const SuperPointOptions options = Options("scores");
  EXPECT_EQ(SuperPoint(PinholeCamera(64, 64), options, Fp32()).Description(),
            "superpoint_toy_scores.xml sha256:" + ModelSha256(options.model) + " fp32");
}

TEST(SuperPointOptions, AreChecked) {
  const auto with = [](auto change) {
    SuperPointOptions options;
    options.model = "m.onnx";
    change(options);
    return options;
  };
  EXPECT_NO_THROW(with([](SuperPointOptions&) {}).Check());
  EXPECT_THROW(with([](SuperPointOptions& o) { o.model = ""; }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.keypoints = 0; }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.threshold = 1; }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.threshold = std::nan(""); }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.nms_radius = -1; }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.border = -1; }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.subpixel_sigma = -1; }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.subpixel_max_offset = 2; }).Check(), Error);
  EXPECT_THROW(with([](SuperPointOptions& o) { o.sigma = 0; }).Check(), Error);
}

/// The real network on a frame of EuRoC.
class SuperPointReal : public testing::Test {
 protected:
  void SetUp() override {
    const char* shared = std::getenv("DEEPUAV_SHARED");
    if (!shared) GTEST_SKIP() << "DEEPUAV_SHARED is not set";
    options_.model = std::filesystem::path(shared) / "models" / "superpoint_coco.onnx";
    const auto folder = std::filesystem::path(shared) / "data/euroc_mh01_excerpt/mav0/cam0/data";
    std::vector<std::filesystem::path> files(std::filesystem::directory_iterator(folder), {});
    image_ = LoadGrey(*std::min_element(files.begin(), files.end()));
  }

  SuperPointOptions options_;
  GreyImage image_;
};

TEST_F(SuperPointReal, FindsPointsAllOverTheImage) {
  const Features features = SuperPoint(PinholeCamera(752, 480), options_, Fp32()).Extract(image_);
  EXPECT_GE(features.size(), 400);
  EXPECT_LE(features.size(), options_.keypoints);
  EXPECT_EQ(features.descriptors.dimension(), 256);
  Eigen::Matrix2i counts = Eigen::Matrix2i::Zero();
  for (int i = 0; i < features.size(); ++i) {
    const Keypoint& keypoint = features.keypoints[static_cast<size_t>(i)];
    ++counts(keypoint.image_px.y() > 240, keypoint.image_px.x() > 376);
    EXPECT_GT(keypoint.score, options_.threshold);
    if (i > 0) {
      EXPECT_LE(keypoint.score, features.keypoints[static_cast<size_t>(i - 1)].score);
    }
    EXPECT_NEAR(features.descriptors.Similarity(i, features.descriptors, i), 1, 0.005);
  }
  EXPECT_GT(counts.minCoeff(), 20);
}

/// The network's maps repeat exactly only after shifts by whole cells; between, descriptors differ
/// more.
TEST_F(SuperPointReal, AgreesWithItselfAfterAShift) {
  constexpr int kWidth = 640, kHeight = 400;
  SuperPoint extractor(PinholeCamera(kWidth, kHeight), options_, Fp32());
  struct Case {
    cv::Point shift;
    double least_similarity, largest_rms_px;
  };
  for (const auto& [shift, least_similarity, largest_rms_px] :
       {Case{{8, 16}, 0.95, 0.25}, Case{{3, 5}, 0.8, 0.5}}) {
    const GreyImage first = image_(cv::Rect(40, 40, kWidth, kHeight)).clone();
    const GreyImage second = image_(cv::Rect(40 - shift.x, 40 - shift.y, kWidth, kHeight)).clone();
    const Features a = extractor.Extract(first), b = extractor.Extract(second);
    int repeated = 0;
    double similarity = 0, squared_error = 0;
    for (int i = 0; i < a.size(); ++i) {
      const Eigen::Vector2f expected =
          a.keypoints[static_cast<size_t>(i)].image_px +
          Eigen::Vector2f(static_cast<float>(shift.x), static_cast<float>(shift.y));
      for (int j = 0; j < b.size(); ++j) {
        const float distance = (b.keypoints[static_cast<size_t>(j)].image_px - expected).norm();
        if (distance > 1.5f) continue;
        ++repeated;
        similarity += a.descriptors.Similarity(i, b.descriptors, j);
        squared_error += distance * distance;
        break;
      }
    }
    EXPECT_GT(repeated, a.size() * 7 / 10) << shift;
    EXPECT_GT(similarity / repeated, least_similarity) << shift;
    EXPECT_LT(std::sqrt(squared_error / repeated), largest_rms_px) << shift;
    RecordProperty(
        fmt::format("shift_{}", shift.x),
        fmt::format("{} of {} repeated, cosine {:.3f}, rms {:.3f} px", repeated, a.size(),
                    similarity / repeated, std::sqrt(squared_error / repeated)));
  }
}

TEST_F(SuperPointReal, IsDeterministic) {
  const Camera camera = PinholeCamera(752, 480);
  SuperPoint one(camera, options_, Fp32()), other(camera, options_, Fp32());
  const Features first = one.Extract(image_);
  for (SuperPoint* extractor : {&one, &other}) {
    const Features again = extractor->Extract(image_);
    ASSERT_EQ(again.size(), first.size());
    std::vector<float> row(256), expected(256);
    for (int i = 0; i < first.size(); ++i) {
      const auto k = static_cast<size_t>(i);
      EXPECT_EQ(std::memcmp(&again.keypoints[k], &first.keypoints[k], sizeof(Keypoint)), 0);
      again.descriptors.Read(i, row);
      first.descriptors.Read(i, expected);
      EXPECT_EQ(row, expected);
    }
  }
}

}  // namespace
}  // namespace deepuav
