#include "deepuav/ortho/landmark_colours.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/io/maps/map_export.h"
#include "support/map_builder.h"

namespace deepuav {
namespace {

constexpr int kWidth = 640, kHeight = 480;

/// View v is of blue v; green and red grow along its columns and rows.
class GradedPhotographs : public Photographs {
 public:
  cv::Size stored_size() const override { return {kWidth, kHeight}; }
  cv::Mat3b Load(int view, const cv::Size& size) override {
    if (view == unreadable) throw Error("view {}: is gone", view);
    cv::Mat3b image(std::min(size.height, rows), size.width);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column)
        image(row, column) = cv::Vec3b(view, Level(column), Level(row));
    }
    return image;
  }
  static uint8_t Level(double px) { return static_cast<uint8_t>(std::lround(px) / 4); }

  int unreadable = -1;
  int rows = kHeight;
};

class ColourPointsTest : public ::testing::Test {
 protected:
  ColourPointsTest() {
    camera_.width = kWidth;
    camera_.height = kHeight;
    const std::vector<KeyframeId> views = {builder_.AddKeyframe(), builder_.AddKeyframe(),
                                           builder_.AddKeyframe()};
    for (int keypoint = 0; keypoint < 20; ++keypoint)
      builder_.AddLandmark({views[keypoint % 3], views[(keypoint + 1) % 3]}, keypoint);
  }

  std::vector<ColouredPoint> Coloured() {
    std::vector<ColouredPoint> points = LandmarkPoints(builder_.map);
    ColourPoints(
        builder_.map, camera_, &photographs_,
        [this](const std::string& why) { unreadable_.push_back(why); }, &points);
    return points;
  }
  const Keypoint& ShownBy(const Landmark& landmark) const {
    return builder_.map.At(landmark.representative.keyframe)
        .features()
        .keypoints[static_cast<size_t>(landmark.representative.keypoint)];
  }

  MapBuilder builder_{1, 30};
  Camera camera_;
  GradedPhotographs photographs_;
  std::vector<std::string> unreadable_;
};

TEST_F(ColourPointsTest, AreThoseOfTheViewThatShowsThemBest) {
  const std::vector<ColouredPoint> points = Coloured();
  size_t i = 0;
  builder_.map.landmarks().ForEach([&](const Landmark& landmark) {
    const Keypoint& keypoint = ShownBy(landmark);
    const auto view = static_cast<uint8_t>(landmark.representative.keyframe.value);
    EXPECT_EQ(points[i].rgb, (std::array{GradedPhotographs::Level(keypoint.image_px.y()),
                                         GradedPhotographs::Level(keypoint.image_px.x()), view}));
    EXPECT_EQ(points[i++].position, landmark.position_world);
  });
  EXPECT_EQ(i, points.size());
  EXPECT_TRUE(unreadable_.empty());
}

TEST_F(ColourPointsTest, OfAnImageThatIsGoneStayAsTheyWere) {
  photographs_.unreadable = 1;
  const std::vector<ColouredPoint> grey = LandmarkPoints(builder_.map), points = Coloured();
  EXPECT_EQ(unreadable_, std::vector<std::string>{"view 1: is gone"});
  size_t i = 0;
  builder_.map.landmarks().ForEach([&](const Landmark& landmark) {
    const bool is_gone = landmark.representative.keyframe.value == 1;
    EXPECT_EQ(points[i].rgb == grey[i].rgb, is_gone);
    ++i;
  });
}

TEST_F(ColourPointsTest, BelowWhereAnImageBreaksOffStayAsTheyWere) {
  photographs_.rows = kHeight / 2;
  const std::vector<ColouredPoint> grey = LandmarkPoints(builder_.map), points = Coloured();
  size_t i = 0;
  builder_.map.landmarks().ForEach([&](const Landmark& landmark) {
    const bool is_below = std::lround(ShownBy(landmark).image_px.y()) >= photographs_.rows;
    EXPECT_EQ(points[i].rgb == grey[i].rgb, is_below);
    ++i;
  });
}

}  // namespace
}  // namespace deepuav
