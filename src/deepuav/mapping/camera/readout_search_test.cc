#include "deepuav/mapping/camera/readout_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/mapping/adjustment/map_adjustment.h"
#include "deepuav/mapping/camera/readout_change.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr double kReadoutS = 0.02;
constexpr FeatureNoise kNoise{0.3, 0.3, 0, 0};
const BundleOptions kBundle{.max_iterations = 50, .min_relative_decrease = 1e-6};
const ReadoutSearchOptions kSearch;

/// Keyframes about landmarks that turn and travel, each in its own way, while they are read.
struct Flight {
  SyntheticMap made;
  Camera camera;
  std::map<KeyframeId, ReadoutMotion> motion_per_s;

  std::optional<FoundReadout> Find(const ReadoutSearchOptions& options = kSearch,
                                   const std::function<bool()>& stop = nullptr) const {
    return FindReadout(made.map, camera, motion_per_s, kBundle, options, stop);
  }
  std::map<KeyframeId, ReadoutMotion> MotionsIn(double readout_s) const {
    std::map<KeyframeId, ReadoutMotion> motions;
    for (const auto& [id, motion] : motion_per_s) motions[id] = InReadout(motion, readout_s);
    return motions;
  }
};

/// Where rows that were read one after the other show what a keyframe sees.
void ReadByRows(KeyframeId id, const ReadoutMotion& motion, const Camera& camera, Map* map) {
  const Keyframe keyframe = map->At(id);
  for (const LandmarkId landmark : keyframe.landmarks) {
    if (!landmark.valid()) continue;
    PixelMeasurement measured =
        std::ranges::find(map->At(landmark).observations, id, &Observation::keyframe)->measured;
    const double depth = (keyframe.cam_from_world * map->At(landmark).position_world).z();
    const Eigen::Vector2d px = measured.px.cast<double>();
    Eigen::Vector2d in_row = px;
    for (int round = 0; round < 5; ++round) {
      in_row = FromMiddleRow(camera.pinhole, px, RowMoment(in_row.y(), camera.height), motion,
                             1 / depth);
    }
    measured.px = in_row.cast<float>();
    measured.by_patch = true;
    map->SetMeasurement(id, landmark, measured);
  }
}

Flight Fly(double readout_s, double turn_rad_s, double travel_per_s, int cameras = 24) {
  Random random(5);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(400, {-4, -4, -3}, {4, 4, 3}, &random);
  const FeatureWorld world(geometry, 6);
  Flight flight{MakeTrueMap(world, OrbitPath(cameras, {0, 0, 0}, 12, 3, 2.5), kNoise, &random),
                world.camera(),
                {}};
  for (const KeyframeId id : flight.made.keyframes) {
    const ReadoutMotion motion{turn_rad_s * RandomDirection(&random),
                               travel_per_s * RandomDirection(&random)};
    flight.motion_per_s[id] = motion;
    ReadByRows(id, InReadout(motion, readout_s), flight.camera, &flight.made.map);
  }
  Pinhole pinhole = geometry.pinhole;
  AdjustMap(&flight.made.map, &pinhole, kBundle, {});
  return flight;
}

TEST(FindReadout, FindsItFromTurns) {
  const Flight flight = Fly(kReadoutS, 0.4, 0);
  const SE3 before = flight.made.map.At(flight.made.keyframes[3]).cam_from_world;
  const auto found = flight.Find();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->change_s, kReadoutS, 0.001);
  EXPECT_LT(found->sigma_s, 0.001);
  EXPECT_TRUE(IsBelieved(*found, kSearch));
  const SE3 after = flight.made.map.At(flight.made.keyframes[3]).cam_from_world;
  EXPECT_EQ(before.translation(), after.translation()) << "the map stays";
}

TEST(FindReadout, FindsItFromTravelInTheMapsOwnScale) {
  const Flight flight = Fly(kReadoutS, 0, 6);
  const auto found = flight.Find();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->change_s, kReadoutS, 0.001);
  EXPECT_TRUE(IsBelieved(*found, kSearch));
}

TEST(FindReadout, FindsWhatKeyframesAreNotYetCorrectedFor) {
  Flight flight = Fly(kReadoutS, 0.4, 4);
  ChangeMotions(flight.MotionsIn(0.012), flight.camera, &flight.made.map);
  const auto found = flight.Find();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->change_s, 0.008, 0.001);
}

TEST(FindReadout, AllRowsAtOnceAreNotTakenForAReadout) {
  for (const double turn_rad_s : {0.0, 0.4}) {
    const auto found = Fly(0, turn_rad_s, 4).Find();
    ASSERT_TRUE(found);
    EXPECT_LT(std::abs(found->change_s), 0.001);
    EXPECT_FALSE(IsBelieved(*found, kSearch));
  }
}

TEST(FindReadout, IsNotBelievedWhereItTakesTooLongOrSavesTooLittle) {
  const FoundReadout good{0.02, 0.0002, 0.3};
  EXPECT_TRUE(IsBelieved(good, kSearch));
  EXPECT_FALSE(IsBelieved({-0.02, 0.0002, 0.3}, kSearch));
  EXPECT_FALSE(IsBelieved({0.2, 0.0002, 0.3}, kSearch));
  EXPECT_FALSE(IsBelieved({0.002, 0.00001, 0.3}, kSearch));
  EXPECT_FALSE(IsBelieved({0.02, 0.004, 0.3}, kSearch));
  EXPECT_FALSE(IsBelieved({0.02, 0.0002, 0.01}, kSearch));
}

TEST(FindReadout, OfOneThatIsKnownCountsWhatIsMoreThanChance) {
  EXPECT_TRUE(IsOff({-0.001, 0.00005, 0.001}, kSearch));
  EXPECT_TRUE(IsOff({0.001, 0.00005, 0.001}, kSearch));
  EXPECT_FALSE(IsOff({0.001, 0.0005, 0.001}, kSearch));
}

TEST(FindReadout, OfACameraAtRestIsNotKnown) {
  const auto found = Fly(kReadoutS, 0, 0).Find();
  EXPECT_FALSE(found && IsBelieved(*found, kSearch));
}

TEST(FindReadout, NeedsKeyframesThatMove) {
  EXPECT_FALSE(Fly(kReadoutS, 0.4, 0, 9).Find());
  Flight flight = Fly(kReadoutS, 0.4, 0);
  flight.motion_per_s.clear();
  EXPECT_FALSE(flight.Find());
}

TEST(FindReadout, FindsNothingWhenStopped) {
  EXPECT_FALSE(Fly(kReadoutS, 0.4, 0).Find(kSearch, [] { return true; }));
}

TEST(FindReadout, OfAnEmptyMapIsNothing) {
  EXPECT_FALSE(FindReadout(Map(MapId{0}), FeatureWorld(SyntheticWorld(), 6).camera(), {}, kBundle,
                           {.min_keyframes = 2}));
}

}  // namespace
}  // namespace deepuav
