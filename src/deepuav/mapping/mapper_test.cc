#include "deepuav/mapping/mapper.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "support/options_with.h"
#include "support/path_error.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.3, 0, 30};

/// A flight past a long box of landmarks whose frames are handed to a Mapper.
class MapperTest : public testing::Test {
 protected:
  explicit MapperTest(const MappingOptions& options = {}) : options_(options) {}

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(1800, {-10, -5, 7}, {50, 5, 15}, &random);
    return FeatureWorld(geometry, 2);
  }
  static SE3 Truth(int frame) {
    const double x = 1.6 * frame;
    return SE3(RotationExp({0, 0.01 * std::sin(0.3 * x), 0}),
               Eigen::Vector3d(-x, 0.2 * std::sin(0.5 * x), 0));
  }

  const SyntheticView& View(int frame) {
    while (static_cast<int>(views_.size()) <= frame) {
      views_.push_back(world_.View(Truth(static_cast<int>(views_.size())), kNoise, &random_));
    }
    return views_[static_cast<size_t>(frame)];
  }
  int KeypointOf(int frame, int landmark) {
    const std::vector<int>& shown = View(frame).landmark;
    const auto place = std::find(shown.begin(), shown.end(), landmark);
    return place == shown.end() ? -1 : static_cast<int>(place - shown.begin());
  }

  /// The two views, with true geometry in units of the baseline.
  InitialMapRequest FirstViews(int first, int second) {
    const SE3 motion = Truth(second) * Truth(first).Inverse();
    const double scale = 1 / motion.translation().norm();
    InitialMapRequest request{FrameOf(first, View(first)),
                              FrameOf(second, View(second)),
                              SE3(motion.rotation(), scale * motion.translation()),
                              {}};
    for (size_t i = 0; i < View(first).landmark.size(); ++i) {
      const int landmark = View(first).landmark[i];
      const int there = landmark < 0 ? -1 : KeypointOf(second, landmark);
      if (there < 0) continue;
      const Eigen::Vector3d position =
          Truth(first) * world_.landmarks()[static_cast<size_t>(landmark)];
      request.points.push_back({scale * position, static_cast<int>(i), there});
    }
    return request;
  }

  /// A request for frame `frame`, as if tracked with a small error against the newest keyframe:
  /// matches are the landmarks of the local map that it sees.
  KeyframeRequest Request(int frame, const LocalMap& local_map) {
    const LocalKeyframe& reference = local_map.keyframes[static_cast<size_t>(local_map.centre)];
    const int reference_frame =
        static_cast<int>(atlas_.At(local_map.map).At(reference.id).frame.id.value);
    SE3 motion = Truth(frame) * Truth(reference_frame).Inverse();
    motion = SE3(motion.rotation(), motion.translation() / depth_);
    KeyframeRequest request{
        local_map.map,
        FrameOf(frame, View(frame)),
        {reference.id, Perturbed(motion, 0.002, 0.001, &random_), reference.scale},
        {},
        {}};
    for (const LocalLandmark& landmark : local_map.landmarks) {
      const Landmark& whole = atlas_.At(local_map.map).At(landmark.id);
      const Observation& o = whole.representative;
      const auto of = static_cast<int>(atlas_.At(local_map.map).At(o.keyframe).frame.id.value);
      const int shown = View(of).landmark[static_cast<size_t>(o.keypoint)];
      const int keypoint = shown < 0 ? -1 : KeypointOf(frame, shown);
      if (keypoint < 0) continue;
      request.matches.push_back({keypoint, landmark.id});
      request.views.push_back({landmark.id, 1, 1});
    }
    return request;
  }

  std::shared_ptr<const LocalMap> Start() {
    auto local_map = mapper_.StartMap(FirstViews(0, 1));
    std::vector<double> depths;
    for (size_t i = 0; i < View(0).landmark.size(); ++i) {
      const int landmark = View(0).landmark[i];
      if (landmark >= 0 && KeypointOf(1, landmark) >= 0) {
        depths.push_back((Truth(0) * world_.landmarks()[static_cast<size_t>(landmark)]).z());
      }
    }
    std::nth_element(depths.begin(), depths.begin() + static_cast<long>(depths.size() / 2),
                     depths.end());
    depth_ = depths[depths.size() / 2];
    return local_map;
  }
  const Map& map() const { return atlas_.At(atlas_.Remaining().back()); }

  const FeatureWorld world_ = MakeWorld();
  Random random_{3};
  std::vector<SyntheticView> views_;
  Atlas atlas_;
  const MappingOptions options_;
  Mapper mapper_{world_.camera(), options_, &atlas_, nullptr};
  double depth_ = 1;  ///< True length of the map's unit.
};

TEST_F(MapperTest, StartsAMapWithTheMedianDepthAsUnit) {
  const auto local_map = Start();
  ASSERT_TRUE(local_map);
  EXPECT_EQ(map().KeyframeCount(), 2);
  EXPECT_NEAR(map().MedianDepth({0}), 1, 1e-9);
  EXPECT_EQ(map().At(KeyframeId{0}).cam_from_world.Matrix(), Eigen::Matrix4d::Identity());
  EXPECT_EQ(map().At(KeyframeId{1}).parent, KeyframeId{0});
  EXPECT_EQ(local_map->keyframes[static_cast<size_t>(local_map->centre)].id, KeyframeId{1});
  EXPECT_GT(map().LandmarkCount(), 150);
  EXPECT_EQ(static_cast<int>(local_map->landmarks.size()), map().LandmarkCount());
  const SE3 truth = Truth(1) * Truth(0).Inverse();
  EXPECT_NEAR(map().At(KeyframeId{1}).cam_from_world.translation().norm(),
              truth.translation().norm() / depth_, 0.05 * truth.translation().norm() / depth_);
}

TEST_F(MapperTest, StartsNoMapFromViewsThatContradictOneAnother) {
  InitialMapRequest request = FirstViews(0, 1);
  for (auto& point : request.points) point.position_first.z() *= -1;
  EXPECT_FALSE(mapper_.StartMap(request));
  request.points.clear();
  EXPECT_FALSE(mapper_.StartMap(request));
  EXPECT_TRUE(atlas_.Remaining().empty());
  EXPECT_TRUE(Start()) << "it goes on after that";
}

TEST_F(MapperTest, AFlightStaysNearTheTruth) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  for (int frame = 2; frame < 22; ++frame) {
    local_map = mapper_.InsertKeyframe(Request(frame, *local_map));
    ASSERT_TRUE(local_map);
    const KeyframeId newest = local_map->keyframes[static_cast<size_t>(local_map->centre)].id;
    ASSERT_EQ(map().At(newest).frame.id, FrameId{frame});
    ASSERT_GT(map().At(newest).LandmarkCount(), 60) << frame;
  }
  EXPECT_GT(map().KeyframeCount(), 5);
  const auto path_error = [this] {
    std::vector<Eigen::Vector3d> estimate, truth;
    map().keyframes().ForEach([&](const Keyframe& keyframe) {
      estimate.push_back(keyframe.cam_from_world.InverseTranslation());
      truth.push_back(Truth(static_cast<int>(keyframe.frame.id.value)).InverseTranslation());
    });
    return RmseAfterAlignment(estimate, truth);
  };
  EXPECT_LT(path_error(), 0.1) << "over a path of 34 m";
  Pinhole pinhole = world_.camera().pinhole;
  mapper_.AdjustGlobally(map().id(), &pinhole, false);
  EXPECT_LT(path_error(), 0.05);

  int wrong = 0, observations = 0;
  map().landmarks().ForEach([&](const Landmark& landmark) {
    std::map<int, int> shown;
    for (const Observation& o : landmark.observations) {
      const auto frame = static_cast<size_t>(map().At(o.keyframe).frame.id.value);
      ++shown[views_[frame].landmark[static_cast<size_t>(o.keypoint)]];
      ++observations;
    }
    int most = 0;
    for (const auto& entry : shown) most = std::max(most, entry.second);
    wrong += static_cast<int>(landmark.observations.size()) - most;
  });
  EXPECT_LT(wrong, observations / 200);
}

TEST_F(MapperTest, CullsKeyframesWhoseLandmarksOthersSeeAndKnowsTheirPoses) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  // Hovering: all frames see the same.
  for (int frame = 3; frame < 12; ++frame) {
    KeyframeRequest request = Request(3, *local_map);
    request.frame.id = FrameId{3};
    local_map = mapper_.InsertKeyframe(request);
  }
  EXPECT_LT(map().KeyframeCount(), 8);
  EXPECT_TRUE(map().Contains(KeyframeId{0})) << "the root stays";
  for (int64_t id = 2; id < 11; ++id) {
    const SE3 difference = map().PoseOf(KeyframeId{id}) * map().PoseOf(KeyframeId{2}).Inverse();
    EXPECT_LT(difference.translation().norm(), 0.01) << id;
  }
}

TEST_F(MapperTest, CullsYoungLandmarksThatAreNotFoundAgain) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  KeyframeRequest request = Request(3, *local_map);
  // Half of them were never where they should be.
  std::vector<LandmarkId> never_found;
  for (ViewCount& view : request.views) {
    if (view.landmark.value % 2 == 0) continue;
    view = {view.landmark, 10, 1};
    never_found.push_back(view.landmark);
  }
  ASSERT_GT(never_found.size(), 50u);
  mapper_.InsertKeyframe(request);
  for (LandmarkId id : never_found) EXPECT_FALSE(map().Current(id)) << id.value;
  EXPECT_GT(map().LandmarkCount(), 50);
}

/// Culling a keyframe takes observations of landmarks that have proved themselves.
class MapperThatKeepsAllKeyframesTest : public MapperTest {
 protected:
  MapperThatKeepsAllKeyframesTest()
      : MapperTest(OptionsWith(&MappingOptions::redundant_ratio, 2)) {}
};

TEST_F(MapperThatKeepsAllKeyframesTest, CullsLandmarksThatTooFewSeeOnceTheyAreNotYoung) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  for (int frame = 2; frame < 15; ++frame) {
    local_map = mapper_.InsertKeyframe(Request(frame, *local_map));
  }
  EXPECT_EQ(map().KeyframeCount(), 15);
  int old = 0, thin = 0;
  map().landmarks().ForEach([&](const Landmark& landmark) {
    if (14 - landmark.created_by.value < options_.young_keyframes) return;
    ++old;
    // An outlier may have been taken from it since.
    thin += static_cast<int>(landmark.observations.size()) < options_.min_young_observations;
  });
  EXPECT_GT(old, 100);
  EXPECT_LT(thin, old / 20);
}

TEST_F(MapperTest, TakesARequestWhoseReferenceAndLandmarksAreGone) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  KeyframeRequest late = Request(4, *local_map);
  for (int frame = 3; frame < 9; ++frame)
    local_map = mapper_.InsertKeyframe(Request(3, *local_map));
  late.matches.push_back({0, {999'999}});
  late.views.push_back({{999'999}, 3, 3});
  const auto after = mapper_.InsertKeyframe(late);
  ASSERT_TRUE(after);
  EXPECT_GT(after->landmarks.size(), 50u);
}

TEST_F(MapperTest, KeepsMapsApart) {
  ASSERT_TRUE(Start());
  const int landmarks = map().LandmarkCount();
  const auto second = mapper_.StartMap(FirstViews(20, 22));
  ASSERT_TRUE(second);
  EXPECT_EQ(second->map, MapId{1});
  EXPECT_EQ(atlas_.Remaining().size(), 2u);
  EXPECT_EQ(atlas_.At(MapId{0}).LandmarkCount(), landmarks);
  atlas_.At(MapId{1}).keyframes().ForEach([this](const Keyframe& keyframe) {
    EXPECT_FALSE(atlas_.At(MapId{0}).Contains(keyframe.id)) << "ids are unique over all maps";
  });
}

TEST_F(MapperTest, CullsTheYoungOfAMapThatGoesOnAfterAnother) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  std::vector<LandmarkId> young;
  atlas_.At(MapId{0}).landmarks().ForEach([&](const Landmark& l) { young.push_back(l.id); });
  for (LandmarkId id : young) atlas_.At(MapId{0}).CountViews(id, 100, 0);
  ASSERT_TRUE(mapper_.StartMap(FirstViews(20, 22)));
  const auto kept = [&] {
    return std::count_if(young.begin(), young.end(),
                         [&](LandmarkId id) { return atlas_.At(MapId{0}).Contains(id); });
  };
  EXPECT_EQ(kept(), static_cast<long>(young.size())) << "of the other map";
  KeyframeRequest request = Request(2, *local_map);
  request.views.clear();
  mapper_.InsertKeyframe(request);
  EXPECT_LT(kept(), static_cast<long>(young.size()) / 10) << "hardly ever found again";
}

TEST_F(MapperTest, YoungLandmarksAgeByKeyframesOfTheirOwnMap) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  std::vector<LandmarkId> young;
  atlas_.At(MapId{0}).landmarks().ForEach([&](const Landmark& l) { young.push_back(l.id); });
  ASSERT_TRUE(mapper_.StartMap(FirstViews(20, 22)));
  KeyframeRequest request = Request(2, *local_map);
  request.matches.resize(request.matches.size() / 2);
  request.views.resize(request.matches.size());
  mapper_.InsertKeyframe(request);
  const Map& first = atlas_.At(MapId{0});
  int seen_twice = 0;
  for (LandmarkId id : young) {
    ASSERT_TRUE(first.Contains(id) || first.Current(id)) << "one keyframe later";
    const auto current = first.Current(id);
    seen_twice += current && first.At(*current).observations.size() == 2;
  }
  EXPECT_GT(seen_twice, 10);
}

TEST_F(MapperTest, LandmarksOfALoadedMapAreStillYoung) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  std::vector<LandmarkId> young;
  map().landmarks().ForEach([&](const Landmark& l) { young.push_back(l.id); });
  for (LandmarkId id : young) atlas_.At(MapId{0}).CountViews(id, 100, 0);
  Mapper later(world_.camera(), options_, &atlas_, nullptr);
  later.Resume();
  KeyframeRequest request = Request(2, *local_map);
  request.views.clear();
  later.InsertKeyframe(request);
  const auto kept =
      std::count_if(young.begin(), young.end(), [&](LandmarkId id) { return map().Contains(id); });
  EXPECT_LT(kept, static_cast<long>(young.size()) / 10) << "hardly ever found again";
}

TEST_F(MapperTest, AStartOfWhichLittleIsLeftIsNone) {
  InitialMapRequest request = FirstViews(0, 1);
  ASSERT_GT(request.points.size(), 50u);
  const std::vector<InitialMapRequest::Point> right = request.points;
  for (size_t i = 0; 10 * i < 7 * right.size(); ++i)
    request.points[i].keypoint_second = right[(i + 17) % right.size()].keypoint_second;
  std::map<int, int> uses;
  std::erase_if(request.points,
                [&](const auto& point) { return uses[point.keypoint_second]++ > 0; });
  EXPECT_FALSE(mapper_.StartMap(request));
  EXPECT_TRUE(atlas_.Remaining().empty());
}

TEST(MappingOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(MappingOptions().Check());
  EXPECT_THROW(OptionsWith(&MappingOptions::min_found_ratio, 1.5).Check(), Error);
  EXPECT_THROW(OptionsWith(&MappingOptions::young_keyframes, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&MappingOptions::window_keyframes, 1).Check(), Error);
  MappingOptions inner;
  inner.creation.epipolar.ratio = 0;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
