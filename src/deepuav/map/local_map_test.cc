#include "deepuav/map/local_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "support/map_builder.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

/// A camera that moves sideways along a long wall of landmarks; far keyframes share none.
SyntheticMap MapAlongAWall(int keyframes) {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(1500, {-10, -4, 8}, {60, 4, 12}, &random);
  std::vector<SE3> poses;
  for (int i = 0; i < keyframes; ++i) {
    poses.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-2.0 * i, 0, 0));
  }
  return MakeTrueMap(FeatureWorld(geometry, 2), poses, {0, 0.2, 0, 20}, &random);
}

std::vector<float> Row(const Descriptors& descriptors, int index) {
  std::vector<float> row(static_cast<size_t>(descriptors.dimension()));
  descriptors.Read(index, row);
  return row;
}

void ExpectCopyOf(const LocalMap& local, const Map& map) {
  for (size_t i = 0; i < local.landmarks.size(); ++i) {
    const LocalLandmark& copy = local.landmarks[i];
    const Landmark& landmark = map.At(copy.id);
    if (i > 0) {
      EXPECT_LT(local.landmarks[i - 1].id, copy.id);
    }
    EXPECT_EQ(copy.position_world, landmark.position_world);
    EXPECT_EQ(copy.mean_view_direction, landmark.mean_view_direction);
    EXPECT_EQ(copy.min_distance, landmark.min_distance);
    EXPECT_EQ(copy.max_distance, landmark.max_distance);
    const Observation& shown = landmark.representative;
    EXPECT_EQ(Row(local.descriptors, static_cast<int>(i)),
              Row(map.At(shown.keyframe).features().descriptors, shown.keypoint));
  }
  for (size_t k = 0; k < local.keyframes.size(); ++k) {
    const LocalKeyframe& copy = local.keyframes[k];
    const Keyframe& keyframe = map.At(copy.id);
    if (k > 0) {
      EXPECT_LT(local.keyframes[k - 1].id, copy.id);
    }
    EXPECT_EQ(copy.features, keyframe.frame.features);
    EXPECT_EQ(copy.cam_from_world.translation(), keyframe.cam_from_world.translation());
    ASSERT_EQ(copy.landmarks.size(), keyframe.landmarks.size());
    for (size_t i = 0; i < copy.landmarks.size(); ++i) {
      if (copy.landmarks[i] >= 0) {
        EXPECT_EQ(local.landmarks[static_cast<size_t>(copy.landmarks[i])].id,
                  keyframe.landmarks[i]);
      }
    }
  }
}

int Unlinked(const LocalMap& local, const Map& map) {
  int unlinked = 0;
  for (const LocalKeyframe& copy : local.keyframes) {
    const Keyframe& keyframe = map.At(copy.id);
    for (size_t i = 0; i < copy.landmarks.size(); ++i) {
      unlinked += keyframe.landmarks[i].valid() && copy.landmarks[i] < 0;
    }
  }
  return unlinked;
}

TEST(MakeLocalMap, CopiesACentreItsNeighboursAndTheirsWithAllTheirLandmarks) {
  const SyntheticMap made = MapAlongAWall(25);
  const KeyframeId centre = made.keyframes[12];
  const auto local = MakeLocalMap(made.map, centre, {});
  EXPECT_EQ(local->map, made.map.id());
  EXPECT_EQ(local->keyframes[static_cast<size_t>(local->centre)].id, centre);
  EXPECT_GT(local->landmarks.size(), 300u);
  EXPECT_EQ(local->descriptors.size(), static_cast<int>(local->landmarks.size()));
  ExpectCopyOf(*local, made.map);
  EXPECT_EQ(Unlinked(*local, made.map), 0);
  std::set<KeyframeId> inside;
  for (const LocalKeyframe& keyframe : local->keyframes) inside.insert(keyframe.id);
  for (KeyframeId neighbour : made.map.Covisible(centre, 15, 100)) {
    EXPECT_TRUE(inside.contains(neighbour));
    for (KeyframeId second : made.map.Covisible(neighbour, 15, 100)) {
      EXPECT_TRUE(inside.contains(second));
    }
  }
}

TEST(MakeLocalMap, DoesNotChangeWithTheMap) {
  SyntheticMap made = MapAlongAWall(5);
  const auto local = MakeLocalMap(made.map, made.keyframes[2], {});
  const Eigen::Vector3d position = local->landmarks[0].position_world;
  const LandmarkId id = local->landmarks[0].id;
  made.map.SetPosition(id, {1, 2, 3});
  made.map.RemoveLandmark(id);
  made.map.RemoveKeyframe(made.keyframes[2]);
  EXPECT_EQ(local->landmarks[0].position_world, position);
  EXPECT_EQ(local->keyframes[static_cast<size_t>(local->centre)].id, made.keyframes[2]);
  EXPECT_GT(local->keyframes[static_cast<size_t>(local->centre)].features->size(), 0);
}

TEST(MakeLocalMap, HoldsTheLimitOfKeyframesTheNearestFirst) {
  const SyntheticMap made = MapAlongAWall(25);
  LocalMapOptions options;
  options.max_keyframes = 4;
  const auto local = MakeLocalMap(made.map, made.keyframes[10], options);
  ASSERT_EQ(local->keyframes.size(), 4u);
  const auto nearest = made.map.Covisible(made.keyframes[10], 1, 3);
  for (const LocalKeyframe& keyframe : local->keyframes) {
    EXPECT_TRUE(keyframe.id == made.keyframes[10] ||
                std::find(nearest.begin(), nearest.end(), keyframe.id) != nearest.end());
  }
}

TEST(MakeLocalMap, HoldsTheLimitOfLandmarksThoseOfTheCentreFirst) {
  const SyntheticMap made = MapAlongAWall(15);
  const KeyframeId centre = made.keyframes[7];
  LocalMapOptions options;
  options.max_landmarks = made.map.At(centre).LandmarkCount() + 5;
  const auto local = MakeLocalMap(made.map, centre, options);
  EXPECT_EQ(static_cast<int>(local->landmarks.size()), options.max_landmarks);
  ExpectCopyOf(*local, made.map);
  EXPECT_GT(Unlinked(*local, made.map), 0);
  const LocalKeyframe& copy = local->keyframes[static_cast<size_t>(local->centre)];
  const auto linked = std::count_if(copy.landmarks.begin(), copy.landmarks.end(),
                                    [](int landmark) { return landmark >= 0; });
  EXPECT_EQ(linked, made.map.At(centre).LandmarkCount());
}

TEST(MakeLocalMap, LeavesOutKeyframesThatShareTooFew) {
  const SyntheticMap made = MapAlongAWall(10);
  const KeyframeId centre = made.keyframes[0];
  LocalMapOptions options;
  options.min_shared_landmarks = 100'000;
  const auto local = MakeLocalMap(made.map, centre, options);
  ASSERT_EQ(local->keyframes.size(), 1u);
  EXPECT_EQ(local->centre, 0);
  EXPECT_EQ(static_cast<int>(local->landmarks.size()), made.map.At(centre).LandmarkCount());
}

SE3 Turned(double heading_deg) {
  return SE3(RotationExp({0, 0, heading_deg * M_PI / 180}), Eigen::Vector3d::Zero());
}

/// One landmark at key point 0 of cameras at the origin under these headings.
Map MapOfHeadings(const std::vector<double>& headings_deg) {
  MapBuilder builder(5, 3);
  std::vector<KeyframeId> ids;
  for (double heading_deg : headings_deg) {
    ids.push_back(builder.AddKeyframe(Turned(heading_deg)));
    if (ids.size() > 1) builder.map.ConnectToParent(ids.back(), ids.front());
  }
  builder.map.UpdateViewRange(builder.AddLandmark(ids, 0));
  return std::move(builder.map);
}

struct HeadingCase {
  std::vector<double> headings_deg;
  int centre = 0, expected = 0;  ///< Of these.
};

TEST(MakeLocalMap, DescribesALandmarkAsSeenUnderTheHeadingOfTheCentre) {
  const std::vector<HeadingCase> cases = {
      {{0, 90, 180, 270}, 2, 2}, {{0, -90}, 1, 1},
      {{0, 20, 25}, 2, 0},    // The representative, the first, is near enough.
      {{0, 29}, 1, 0},        //
      {{0, 31}, 1, 1},        //
      {{0, 100, 140}, 2, 2},  //
      {{170, -170}, 1, 0},    // 20 degrees apart, across the turn.
      {{340, 40, 25}, 2, 2},  // 45, 15 and 0 degrees.
  };
  for (const HeadingCase& c : cases) {
    const Map map = MapOfHeadings(c.headings_deg);
    ASSERT_EQ(map.At(LandmarkId{0}).representative.keyframe, KeyframeId{0});
    const auto local = MakeLocalMap(map, {c.centre}, {});
    ASSERT_EQ(local->descriptors.size(), 1);
    EXPECT_EQ(Row(local->descriptors, 0),
              Row(map.At(KeyframeId{c.expected}).features().descriptors, 0))
        << c.headings_deg[static_cast<size_t>(c.centre)];
  }
}

TEST(MakeLocalMap, TakesTheLeastTurnedDescriptionWhereTheCentreHasNone) {
  MapBuilder builder(6, 3);
  std::vector<KeyframeId> ids;
  for (double heading_deg : {0, 70, 120, 90}) {
    ids.push_back(builder.AddKeyframe(Turned(heading_deg)));
    if (ids.size() > 1) builder.map.ConnectToParent(ids.back(), ids.front());
  }
  builder.AddLandmark({ids[0], ids[1], ids[2]}, 0);
  for (int keypoint : {1, 2}) builder.AddLandmark({ids[0], ids[3]}, keypoint);
  LocalMapOptions options;
  options.min_shared_landmarks = 1;
  options.max_heading_difference_deg = 15;
  const auto local = MakeLocalMap(builder.map, ids[3], options);
  ASSERT_EQ(local->landmarks.size(), 3u);
  EXPECT_EQ(Row(local->descriptors, 0), Row(builder.map.At(ids[1]).features().descriptors, 0))
      << "20 degrees off";
}

TEST(LocalMapOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(LocalMapOptions().Check());
  EXPECT_THROW((LocalMapOptions{.max_keyframes = 1}.Check()), Error);
  EXPECT_THROW((LocalMapOptions{.min_shared_landmarks = 0}.Check()), Error);
  EXPECT_THROW((LocalMapOptions{.max_landmarks = 99}.Check()), Error);
  EXPECT_THROW((LocalMapOptions{.max_heading_difference_deg = 0}.Check()), Error);
}

}  // namespace
}  // namespace deepuav
