#include "deepuav/survey/survey_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <numeric>

#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr double kHeightM = 40;
constexpr size_t kViews = 4, kPoints = 80, kClutter = 40;
/// This photograph has no pose, this point is seen by one photograph alone, as far as it agrees,
/// and this sight does not agree.
constexpr size_t kOutside = 3, kLonely = 5, kDisagreeing = 9;

/// Photographs by a lens that bends, their key points in no order.
struct MadeSurvey {
  MadeSurvey() {
    camera = FeatureWorld({}, 1).camera();
    camera.lens = LensModel::kRadialTangential;
    camera.distortion = {-0.2, 0.03, 0.001, 0};
    Random random(1);
    points = LandmarksOnGround(kPoints, {-8, -8}, {15, 8}, 3, &random);
    for (size_t t = 0; t < kPoints; ++t)
      looks.push_back(RandomDescriptor(FeatureWorld::kDimension, &random));
    built.tracks.tracks.resize(kPoints);
    for (size_t v = 0; v < kViews; ++v) {
      poses.push_back(
          Perturbed(LookDown({3.0 * static_cast<double>(v), 0, kHeightM}, 0.4), 1, 0.05, &random));
      AddView(static_cast<int>(v), &random);
    }
    built.state = SurveyState(built.tracks, kViews, {});
    for (size_t v = 0; v < kViews; ++v) {
      if (v != kOutside) built.state.cam_from_world[v] = poses[v];
    }
    for (size_t t = 0; t < kPoints; ++t) {
      built.state.points[t] = points[t];
      built.state.agrees[t] = {1, 1, 1, 0};
    }
    built.state.agrees[kLonely] = {0, 1, 0, 0};
    built.state.agrees[kDisagreeing] = {1, 0, 1, 0};
  }

  void AddView(int view, Random* random) {
    std::vector<size_t> order(kPoints + kClutter);
    std::iota(order.begin(), order.end(), size_t{0});
    for (size_t i = order.size() - 1; i > 0; --i)
      std::swap(order[i], order[static_cast<size_t>(random->Index(static_cast<int>(i) + 1))]);
    Features features{{}, Descriptors(FeatureWorld::kDimension)};
    std::vector<SightPixel> px;
    for (const size_t t : order) {
      const Eigen::Vector2d anywhere(random->Uniform(0, 750), random->Uniform(0, 480));
      const Eigen::Vector2d at = t < kPoints ? *camera.Distort(poses.back() * points[t]) : anywhere;
      if (t < kPoints) built.tracks.tracks[t].sights.push_back({view, static_cast<int>(px.size())});
      features.keypoints.push_back(KeypointAt(at));
      features.keypoints.back().score = static_cast<float>(random->Uniform(0, 1));
      features.descriptors.Append(t < kPoints ? looks[t]
                                              : RandomDescriptor(FeatureWorld::kDimension, random));
      px.push_back({at});
    }
    built.px.push_back(std::move(px));
    views.emplace_back().frame.features = std::make_shared<const Features>(std::move(features));
  }

  Camera camera;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::vector<float>> looks;
  std::vector<SE3> poses;
  std::vector<SurveyView> views;
  BuiltSurvey built{{}, SurveyState({}, 0, {}), {}};
};

class SurveyMapTest : public ::testing::Test {
 protected:
  SurveyMapTest()
      : keyframes_(AddSurveyMap(survey_.views, survey_.built, survey_.camera, true, &atlas_)),
        map_(atlas_.At(MapId{0})) {}

  const Features& FeaturesOf(const Observation& seen) const {
    return map_.At(seen.keyframe).features();
  }

  MadeSurvey survey_;
  Atlas atlas_;
  const std::vector<KeyframeId> keyframes_;
  const Map& map_;
};

TEST_F(SurveyMapTest, HasAKeyframeOfEachPhotographWithAPose) {
  ASSERT_EQ(keyframes_.size(), kViews);
  EXPECT_FALSE(keyframes_[kOutside].valid());
  EXPECT_EQ(map_.KeyframeCount(), 3);
  for (const KeyframeId id : keyframes_) {
    if (!id.valid()) continue;
    const std::vector<Keypoint>& keypoints = map_.At(id).features().keypoints;
    EXPECT_EQ(keypoints.size(), kPoints + kClutter);
    EXPECT_TRUE(std::ranges::is_sorted(keypoints, std::greater{}, &Keypoint::score));
  }
}

TEST_F(SurveyMapTest, LandmarksAreSeenWhereTheyAreByWhatLooksLikeThem) {
  EXPECT_EQ(map_.LandmarkCount(), static_cast<int>(kPoints) - 1) << "one is seen once";
  size_t seen = 0;
  map_.landmarks().ForEach([&](const Landmark& landmark) {
    const Observation& first = landmark.observations.front();
    for (const Observation& here : landmark.observations) {
      const Eigen::Vector2d px = survey_.camera.pinhole.Project(
          map_.At(here.keyframe).cam_from_world * landmark.position_world);
      const Keypoint& keypoint = FeaturesOf(here).keypoints[static_cast<size_t>(here.keypoint)];
      EXPECT_LT((px - keypoint.px.cast<double>()).norm(), 1e-3);
      EXPECT_GT(FeaturesOf(here).descriptors.Similarity(
                    here.keypoint, FeaturesOf(first).descriptors, first.keypoint),
                0.99f);
      ++seen;
    }
  });
  EXPECT_EQ(seen, 3 * (kPoints - 1) - 1) << "but for the sight that does not agree";
}

TEST_F(SurveyMapTest, BeginsAtItsFirstPhotographAndHasItsDepthForAUnit) {
  EXPECT_EQ(map_.root(), keyframes_[0]);
  EXPECT_LT(map_.At(map_.root()).cam_from_world.Log().norm(), 1e-9);
  EXPECT_NEAR(map_.MedianDepth(map_.root()), 1, 1e-9);
  const auto apart = [](const SE3& a, const SE3& b) {
    return (a.InverseTranslation() - b.InverseTranslation()).norm();
  };
  const double unit_m =
      apart(survey_.poses[0], survey_.poses[2]) /
      apart(map_.At(keyframes_[0]).cam_from_world, map_.At(keyframes_[2]).cam_from_world);
  EXPECT_NEAR(unit_m, kHeightM, 0.1 * kHeightM);
}

}  // namespace
}  // namespace deepuav
