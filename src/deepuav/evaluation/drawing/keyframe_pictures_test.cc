#include "deepuav/evaluation/drawing/keyframe_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/evaluation/drawing/packed_array.h"

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

Camera TestCamera() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  return camera;
}

/// Frames "0.png", ... at nanosecond 0, ...; the third cannot be read.
class FewImages : public Dataset {
 public:
  std::string Kind() const override { return "tum"; }
  const Camera& camera() const override { return camera_; }
  int size() const override { return 4; }
  Timestamp Time(int frame) const override { return {frame}; }
  std::string Name(int frame) const override { return fmt::format("folder/{}.png", frame); }
  GreyImage Load(int frame) override {
    if (frame == 2) throw Error("2.png: is broken");
    return GreyImage(camera_.height, camera_.width, uint8_t{80});
  }
  cv::Mat3b LoadColour(int /*frame*/, const cv::Size& size) override { return cv::Mat3b(size); }

 private:
  const Camera camera_ = TestCamera();
};

Map MapOf(int keyframes, const std::vector<Eigen::Vector2f>& places = {{1, 2}}) {
  Map map({0});
  for (int i = 0; i < keyframes; ++i) {
    auto features = std::make_shared<Features>();
    for (const Eigen::Vector2f& place : places) features->keypoints.push_back({place, place, 1, 1});
    map.AddKeyframe({i}, {FrameId{i}, Timestamp{i}, features}, SE3());
  }
  return map;
}

std::vector<int> FirstsOf(const nlohmann::json& pictures) {
  std::vector<int> firsts;
  for (const auto& picture : pictures) {
    firsts.push_back(picture["views"][0]["keyframe"]);
    EXPECT_EQ(picture["views"][1]["keyframe"], firsts.back() + 1);
  }
  return firsts;
}

TEST(KeyframePictures, NeedTwoKeyframes) {
  EXPECT_THAT(KeyframePictures(MapOf(0), TestCamera(), {}, nullptr), IsEmpty());
  EXPECT_THAT(KeyframePictures(MapOf(1), TestCamera(), {}, nullptr), IsEmpty());
  EXPECT_THAT(KeyframePictures(MapOf(2), TestCamera(), {}, nullptr), SizeIs(1));
  EXPECT_THAT(KeyframePictures(MapOf(9), TestCamera(), {}, nullptr, {.pairs = 0}), IsEmpty());
}

TEST(KeyframePictures, AreSpreadEvenlyWithoutRepeats) {
  const auto firsts = [](int keyframes, int pairs) {
    return FirstsOf(
        KeyframePictures(MapOf(keyframes), TestCamera(), {}, nullptr, {.pairs = pairs}));
  };
  EXPECT_THAT(firsts(11, 1), ElementsAre(5));
  EXPECT_THAT(firsts(11, 2), ElementsAre(2, 7));
  EXPECT_THAT(firsts(4, 90), ElementsAre(0, 1, 2));
  const std::vector<int> many = firsts(101, 37);
  EXPECT_EQ(std::set<int>(many.begin(), many.end()).size(), 37u);
}

TEST(KeyframePictures, HaveTheImagesThatTheDatasetStillHas) {
  FewImages dataset;
  const auto has_image = [](const nlohmann::json& view) {
    if (!view.contains("image")) return false;
    EXPECT_THAT(view["image"].get<std::string>(), StartsWith("data:image/jpeg;base64,/9j/"));
    return true;
  };
  // Of six keyframes the third cannot be read and the last two are in no dataset.
  const nlohmann::json pictures =
      KeyframePictures(MapOf(6), TestCamera(), {}, &dataset, {.pairs = 5});
  ASSERT_THAT(pictures, SizeIs(5));
  std::vector<bool> first_has_image;
  for (const auto& picture : pictures) first_has_image.push_back(has_image(picture["views"][0]));
  EXPECT_THAT(first_has_image, ElementsAre(true, true, false, true, false));

  // Under another name the same moment may show something else.
  const ImageNames names = {{KeyframeId{0}, "0.png"}, {KeyframeId{1}, "other.png"}};
  const nlohmann::json named = KeyframePictures(MapOf(2), TestCamera(), names, &dataset);
  EXPECT_TRUE(has_image(named[0]["views"][0]));
  EXPECT_FALSE(has_image(named[0]["views"][1]));
}

TEST(KeyframePictures, KeepKeyPointsInsideTheImage) {
  const float huge = 1e30f;
  const Map map = MapOf(2, {{-3, 5.4f}, {70, 47.6f}, {huge, -huge}});
  const nlohmann::json pictures = KeyframePictures(map, TestCamera(), {}, nullptr);
  EXPECT_EQ(pictures[0]["views"][0]["points"], PackShorts({0, 5, 64, 48, 64, 0}));
}

TEST(KeyframePictures, RefuseOptionsOutOfRange) {
  for (const PictureOptions& options : {PictureOptions{.pairs = -1}, PictureOptions{.width_px = 0},
                                        PictureOptions{.jpeg_quality = 101}})
    EXPECT_THROW(KeyframePictures(MapOf(2), TestCamera(), {}, nullptr, options), Error);
}

}  // namespace
}  // namespace deepuav
