#include "deepuav/evaluation/drawing/survey_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using ::testing::StartsWith;

constexpr int kViews = 6, kPoints = 150;
constexpr double kError_px = 0.5;

Camera TestCamera() {
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.pinhole = {120, 120, 79.5, 59.5};
  return camera;
}

/// Grey photographs by time.
class GreyDataset : public Dataset {
 public:
  std::string Kind() const override { return "photographs"; }
  const Camera& camera() const override { return camera_; }
  int size() const override { return kViews; }
  Timestamp Time(int frame) const override { return {frame}; }
  std::string Name(int frame) const override { return fmt::format("{}.jpg", frame); }
  GreyImage Load(int /*frame*/) override { return {}; }
  cv::Mat3b LoadColour(int frame, const cv::Size& size) override {
    if (frame == 0) throw Error("0.jpg: is broken");
    return {size, cv::Vec3b::all(90)};
  }

 private:
  const Camera camera_ = TestCamera();
};

/// Six photographs in a row look straight down at points on flat ground; measurements are half a
/// pixel off.
LoadedAtlas FlatSurvey() {
  LoadedAtlas loaded;
  loaded.camera = TestCamera();
  Map& map = loaded.atlas.Add(Map(loaded.atlas.NextMap()));
  const Eigen::Quaterniond down(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  Random random(2);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < kPoints; ++i)
    points.emplace_back(random.Uniform(-5, 15), random.Uniform(-4, 4), random.Gaussian(0.02));
  for (int view = 0; view < kViews; ++view) {
    const SE3 cam_from_world = SE3(down, Eigen::Vector3d(2 * view, 0, 10)).Inverse();
    auto features = std::make_shared<Features>();
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector2f px =
          loaded.camera.pinhole.Project(cam_from_world * point).cast<float>();
      features->keypoints.push_back({px, px, 1, 1});
    }
    Frame frame;
    frame.time = Timestamp{view};
    frame.features = std::move(features);
    map.AddKeyframe({view}, frame, cam_from_world);
  }
  for (int i = 0; i < kPoints; ++i) {
    map.AddLandmark({i}, points[static_cast<size_t>(i)], {0});
    for (int view = 0; view < kViews; ++view) {
      PixelMeasurement measured;
      measured.px = map.At(KeyframeId{view}).features().keypoints[static_cast<size_t>(i)].px +
                    Eigen::Vector2f(static_cast<float>(kError_px), 0);
      map.AddObservation({view}, i, {i}, measured);
    }
  }
  Gauge gauge;
  gauge.kind = GaugeKind::kMetric;
  loaded.atlas.ChangeGauge({0}, Sim3(), gauge);
  return loaded;
}

TEST(SurveyPictures, ShowTheGroundFromAbove) {
  const nlohmann::json pictures =
      SurveyPictures(FlatSurvey(), {0}, std::make_unique<GreyDataset>());
  EXPECT_THAT(pictures["orthophoto"].get<std::string>(), StartsWith("data:image/webp;base64,"));
  EXPECT_THAT(pictures["overlap"].get<std::string>(), StartsWith("data:image/png;base64,"));
  EXPECT_EQ(pictures["overlap_colors"].size(), 8u);
  EXPECT_GT(pictures["aspect"], 1.5);
  ASSERT_EQ(pictures["cameras"].size(), static_cast<size_t>(kViews));
  for (int view = 1; view < kViews; ++view) {
    EXPECT_GT(pictures["cameras"][static_cast<size_t>(view)][0],
              pictures["cameras"][static_cast<size_t>(view) - 1][0]);
  }
  EXPECT_NEAR(pictures["errors"]["median_px"], kError_px, 1e-3);
  EXPECT_NEAR(pictures["errors"]["most_px"], kError_px, 1e-3);
}

TEST(SurveyPictures, WithoutPhotographsThereIsNoOrthophoto) {
  const nlohmann::json pictures = SurveyPictures(FlatSurvey(), {0}, nullptr);
  EXPECT_FALSE(pictures.contains("orthophoto"));
  EXPECT_TRUE(pictures.contains("overlap"));
}

TEST(SurveyPictures, BadInput) {
  EXPECT_THROW(SurveyPictures(FlatSurvey(), {0}, nullptr, {.width_px = 0}), Error);
  LoadedAtlas empty;
  empty.camera = TestCamera();
  empty.atlas.Add(Map(empty.atlas.NextMap()));
  EXPECT_THROW(SurveyPictures(empty, {0}, nullptr), Error);
}

}  // namespace
}  // namespace deepuav
