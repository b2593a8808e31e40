#include "deepuav/mapping/landmarks/landmark_creation.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/geometry/triangulation.h"
#include "support/options_with.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

const PatchObserver kKeyPointsOnly(Camera{}, PatchOptions{.enabled = false}, {});

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

FeatureWorld BoxWorld(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(600, low, high, &random);
  return FeatureWorld(geometry, 2);
}

/// A true map of `world` of which every second landmark is forgotten.
class HalfMap {
 public:
  HalfMap(const FeatureWorld& world, const std::vector<SE3>& poses, const FeatureNoise& noise)
      : world_(world) {
    Random random(3);
    made_ = MakeTrueMap(world, poses, noise, &random);
    for (size_t i = 0; i < made_.landmark_of.size(); i += 2) {
      if (!made_.landmark_of[i].valid()) continue;
      made_.map.RemoveLandmark(made_.landmark_of[i]);
      ++forgotten_;
    }
  }

  std::vector<LandmarkId> Create(const CreationOptions& options = {}, Matcher* learned = nullptr) {
    return CreateLandmarks(&made_.map, made_.keyframes.back(), world_.world().pinhole, &made_.ids,
                           options, kKeyPointsOnly, learned);
  }
  /// The landmark of the world that the key points show; -1 where they show different ones.
  int Shown(LandmarkId id) const {
    int shown = -2;
    for (const Observation& o : map().At(id).observations) {
      const int landmark = made_.views[static_cast<size_t>(o.keyframe.value)]
                               .landmark[static_cast<size_t>(o.keypoint)];
      shown = shown == -2 || shown == landmark ? landmark : -1;
    }
    return shown;
  }
  double DistanceToTruth(LandmarkId id) const {
    return (map().At(id).position_world - world_.landmarks()[static_cast<size_t>(Shown(id))])
        .norm();
  }
  const Map& map() const { return made_.map; }
  const SyntheticMap& made() const { return made_; }
  int forgotten() const { return forgotten_; }

 private:
  const FeatureWorld& world_;
  SyntheticMap made_;
  int forgotten_ = 0;
};

TEST(CreateLandmarks, FindsWhatTheMapHasNotWhereItIs) {
  const FeatureWorld world = BoxWorld({-6, -4, 6}, {8, 4, 14});
  for (const double sigma_px : {0.0, 0.5}) {
    HalfMap half(world, {At({0, 0, 0}), At({0.8, 0, 0}), At({1.6, 0.1, 0})},
                 {sigma_px, 0.3, 0, 30});
    const std::vector<LandmarkId> created = half.Create();
    EXPECT_GT(static_cast<double>(created.size()), 0.75 * half.forgotten());
    double sum = 0;
    for (LandmarkId id : created) {
      const Landmark& landmark = half.map().At(id);
      EXPECT_EQ(landmark.observations.size(), 2u);
      EXPECT_EQ(landmark.created_by, half.made().keyframes.back());
      EXPECT_GT(landmark.max_distance, 0) << "its appearance is known";
      ASSERT_GE(half.Shown(id), 0);
      EXPECT_EQ(half.Shown(id) % 2, 0) << "it was forgotten";
      sum += half.DistanceToTruth(id);
    }
    // Depth 10, baseline 0.8, focal length 450: 0.2 deviation in depth from half a pixel in each.
    EXPECT_LT(sum / static_cast<double>(created.size()), sigma_px == 0 ? 1e-3 : 0.25);
  }
}

TEST(CreateLandmarks, WrongDescriptorsGiveFewWrongLandmarks) {
  const FeatureWorld world = BoxWorld({-6, -4, 6}, {8, 4, 14});
  HalfMap half(world, {At({0, 0, 0}), At({0.8, 0, 0}), At({1.6, 0.1, 0})}, {0.5, 0.3, 0.4, 30});
  const std::vector<LandmarkId> created = half.Create();
  int wrong = 0;
  for (LandmarkId id : created) wrong += half.Shown(id) < 0;
  EXPECT_GT(created.size(), 50u);
  EXPECT_LT(wrong, 0.1 * static_cast<double>(created.size()));
}

/// Knows which key points show the same landmark, and takes `wrong` of every ten for another.
class KnowingMatcher : public Matcher {
 public:
  KnowingMatcher(const std::vector<SyntheticView>& views, int wrong)
      : views_(views), wrong_(wrong) {}

  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    ++asked;
    const std::vector<int>&shown_a = ShownBy(a), &shown_b = ShownBy(b);
    std::vector<Match> matches;
    for (size_t i = 0; i < shown_a.size(); ++i) {
      const auto j = std::find(shown_b.begin(), shown_b.end(), shown_a[i]);
      if (shown_a[i] >= 0 && j != shown_b.end())
        matches.push_back({static_cast<int>(i), static_cast<int>(j - shown_b.begin()), 1});
    }
    for (size_t i = 1; i < matches.size(); ++i) {
      if (static_cast<int>(i % 10) < wrong_) std::swap(matches[i].b, matches[i - 1].b);
    }
    return matches;
  }
  std::string Description() const override { return "knows"; }

  int asked = 0;

 private:
  const std::vector<int>& ShownBy(const Features& features) const {
    return std::find_if(views_.begin(), views_.end(),
                        [&](const SyntheticView& view) { return view.features.get() == &features; })
        ->landmark;
  }

  const std::vector<SyntheticView>& views_;
  const int wrong_;
};

const FeatureNoise kHalfOfTheDescriptorsWrong{0.5, 0.3, 0.5, 30};

TEST(CreateLandmarks, FromLearnedMatchesWhereDescriptorsFail) {
  const FeatureWorld world = BoxWorld({-6, -4, 6}, {8, 4, 14});
  const std::vector<SE3> poses = {At({0, 0, 0}), At({0.8, 0, 0}), At({1.6, 0.1, 0})};
  HalfMap by_neighbours(world, poses, kHalfOfTheDescriptorsWrong);
  const size_t few = by_neighbours.Create().size();
  for (const int wrong : {0, 3}) {
    HalfMap half(world, poses, kHalfOfTheDescriptorsWrong);
    KnowingMatcher matcher(half.made().views, wrong);
    const auto created =
        half.Create(OptionsWith(&CreationOptions::learned_neighbours, 2), &matcher);
    EXPECT_EQ(matcher.asked, 2);
    EXPECT_GT(static_cast<double>(created.size()), 1.3 * static_cast<double>(few));
    int mistaken = 0;
    for (LandmarkId id : created) mistaken += half.Shown(id) < 0;
    EXPECT_LT(mistaken, 0.12 * static_cast<double>(created.size())) << "off their lines";
  }
}

TEST(CreateLandmarks, LearnedMatchesGiveNoKeyPointASecondLandmark) {
  const FeatureWorld world = BoxWorld({-6, -4, 6}, {8, 4, 14});
  HalfMap half(world, {At({0, 0, 0}), At({0.8, 0, 0}), At({1.6, 0.1, 0})}, {0.5, 0.3, 0, 30});
  KnowingMatcher matcher(half.made().views, 0);
  const auto created = half.Create(OptionsWith(&CreationOptions::learned_neighbours, 2), &matcher);
  EXPECT_GT(static_cast<double>(created.size()), 0.75 * half.forgotten());
  for (LandmarkId id : created) {
    ASSERT_GE(half.Shown(id), 0);
    EXPECT_EQ(half.Shown(id) % 2, 0) << "the others are in the map";
  }
}

TEST(CreateLandmarks, AsksTheLearnedMatcherForTheNearestNeighboursOnly) {
  const FeatureWorld world = BoxWorld({-6, -4, 6}, {8, 4, 14});
  const std::vector<SE3> poses = {At({0, 0, 0}), At({0.8, 0, 0}), At({1.6, 0.1, 0})};
  for (const int neighbours : {0, 1, 5}) {
    HalfMap half(world, poses, {0.5, 0.3, 0, 0});
    KnowingMatcher matcher(half.made().views, 0);
    half.Create(OptionsWith(&CreationOptions::learned_neighbours, neighbours), &matcher);
    EXPECT_EQ(matcher.asked, std::min(neighbours, 2)) << "it has two neighbours";
  }
}

TEST(CreateLandmarks, OnlyWithParallax) {
  const FeatureWorld world = BoxWorld({-20, -10, 20}, {20, 10, 150});
  HalfMap half(world, {At({0, 0, 0}), At({1, 0, 0})}, {});
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0);
  const std::vector<LandmarkId> created =
      half.Create(OptionsWith(&CreationOptions::min_baseline_ratio, 0));
  EXPECT_GT(created.size(), 5u);
  for (LandmarkId id : created) {
    EXPECT_GE(ParallaxAngle(a, b, half.map().At(id).position_world), 0.99 * M_PI / 180);
    EXPECT_LT(half.map().At(id).position_world.z(), 60);
  }
}

TEST(CreateLandmarks, NotWhereTheBaselineIsShortForTheDepth) {
  const FeatureWorld world = BoxWorld({-6, -4, 6}, {8, 4, 14});
  HalfMap half(world, {At({0, 0, 0}), At({0.5, 0, 0})}, {});
  EXPECT_TRUE(half.Create(OptionsWith(&CreationOptions::min_baseline_ratio, 0.2)).empty());
  EXPECT_FALSE(half.Create(OptionsWith(&CreationOptions::min_baseline_ratio, 0.01)).empty());
}

TEST(CreateLandmarks, NotFromAPairOfCamerasInOnePlace) {
  const FeatureWorld world = BoxWorld({-6, -4, 6}, {8, 4, 14});
  HalfMap half(world, {At({0, 0, 0}), At({0, 0, 0})}, {0.5, 0.3, 0, 0});
  EXPECT_TRUE(half.Create(OptionsWith(&CreationOptions::min_baseline_ratio, 0)).empty());
}

TEST(CreateLandmarks, OnlyAtSimilarDistanceFromBothCameras) {
  const FeatureWorld world = BoxWorld({-6, -4, 8}, {6, 4, 20});
  HalfMap half(world, {At({0, 0, 0}), At({0.3, 0, 5})}, {});
  const std::vector<LandmarkId> created =
      half.Create(OptionsWith(&CreationOptions::max_distance_ratio, 1.5));
  EXPECT_GT(created.size(), 5u);
  for (LandmarkId id : created) {
    const Eigen::Vector3d position = half.map().At(id).position_world;
    EXPECT_LE(position.norm() / (position - Eigen::Vector3d(0.3, 0, 5)).norm(), 1.5);
  }
  HalfMap all(world, {At({0, 0, 0}), At({0.3, 0, 5})}, {});
  EXPECT_GT(all.Create(OptionsWith(&CreationOptions::max_distance_ratio, 10)).size(),
            created.size());
}

/// Two cameras a unit apart with one landmark each can see, and 40 shared so that they are
/// covisible. The key points of the one are given.
std::vector<LandmarkId> CreateFromPixels(const Eigen::Vector2d& px_a, const Eigen::Vector2d& px_b,
                                         const CreationOptions& options) {
  Random random(4);
  const std::vector<float> row = RandomDescriptor(32, &random);
  const Pinhole pinhole{450, 450, 376, 240};
  const std::vector<SE3> poses = {At({0, 0, 0}), At({1, 0, 0})};
  Map map{MapId{0}};
  IdSource ids;
  for (const SE3& pose : poses) {
    Features features{{}, Descriptors(32)};
    features.keypoints.push_back(KeypointAt(ids.keyframes == 0 ? px_a : px_b));
    features.descriptors.Append(row);
    features.keypoints.push_back(KeypointAt(pinhole.Project(pose * Eigen::Vector3d(0, 0, 10))));
    features.descriptors.Append(RandomDescriptor(32, &random));
    const KeyframeId id = ids.NextKeyframe();
    map.AddKeyframe(id, {FrameId{id.value}, {}, std::make_shared<const Features>(features)}, pose);
  }
  const LandmarkId shared = ids.NextLandmark();
  map.AddLandmark(shared, {0, 0, 10}, {1});
  map.AddObservation({0}, 1, shared);
  map.AddObservation({1}, 1, shared);
  return CreateLandmarks(&map, {1}, pinhole, &ids, options, kKeyPointsOnly);
}

TEST(CreateLandmarks, NotBehindTheCameras) {
  EXPECT_EQ(CreateFromPixels({400, 200}, {360, 200}, {}).size(), 1u) << "depth 450 / 40";
  EXPECT_TRUE(CreateFromPixels({360, 200}, {400, 200}, {}).empty()) << "depth -450 / 40";
}

TEST(CreateLandmarks, NotWhereTheRaysMissOneAnother) {
  CreationOptions options;
  options.epipolar.max_distance_px = 10;
  EXPECT_EQ(CreateFromPixels({400, 200}, {360, 203}, options).size(), 1u) << "1.5 px in each";
  EXPECT_TRUE(CreateFromPixels({400, 200}, {360, 207}, options).empty()) << "3.5 px in each";
}

TEST(CreationOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(CreationOptions().Check());
  EXPECT_THROW(OptionsWith(&CreationOptions::max_neighbours, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&CreationOptions::learned_neighbours, -1).Check(), Error);
  EXPECT_THROW(OptionsWith(&CreationOptions::min_parallax_deg, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&CreationOptions::max_distance_ratio, 0.9).Check(), Error);
}

}  // namespace
}  // namespace deepuav
