#include "deepuav/system/sensors/placed_maps.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "deepuav/system/testing/georeferencing_fixture.h"

namespace deepuav {
namespace {

/// A second flight over the same ground, in a map of its own in another world, with its own fixes.
class PlacedMapsTest : public GeoreferencingTest {
 protected:
  PlacedMapsTest() {
    made_.AddMap();
    again_ = made_.Add(MapId{1}, flight_, Sim3(0.3, RotationExp({-0.5, 1, 0.3}), {9, -4, 2}),
                       {0.3, 0.3, 0, 0});
    Random random(5);
    for (size_t i = 0; i < flight_.size(); ++i) {
      const Keyframe& keyframe = made_.atlas.At(MapId{1}).At(again_.keyframes[i]);
      FrameRecord record;
      record.id = keyframe.frame.id;
      record.time = keyframe.frame.time;
      record.map = MapId{1};
      record.pose = {keyframe.id, SE3(), keyframe.scale};
      records_.push_back(record);
      AddFix(record.time, flight_[i].Inverse() * kAntenna, &random);
    }
  }

  int Join(double max_sigma_m) {
    Mapper mapper(camera(), {}, &made_.atlas, nullptr);
    Georeferencing georeferencing(streams_, options_, priors_, &mapper, &made_.atlas);
    Pinhole pinhole = world_.world().pinhole;
    reports_ = georeferencing.ApplyToAll(
        made_.atlas.BySize(), records_, &pinhole, [](MapId) { return false; }, nullptr);
    return JoinPlacedMaps(max_sigma_m, &reports_, &mapper, &made_.atlas);
  }

  Visit again_;
  std::map<MapId, GeoreferenceReport> reports_;
};

TEST_F(PlacedMapsTest, BecomeOneWithWhatIsToldOfBoth) {
  ASSERT_EQ(Join(2), 1);
  ASSERT_EQ(made_.atlas.Remaining(), std::vector<MapId>{MapId{0}});
  const Map& map = made_.atlas.At(MapId{1});
  EXPECT_EQ(map.KeyframeCount(), 2 * flight_.size());
  ASSERT_EQ(reports_.size(), 1u);
  const GeoreferenceReport& report = reports_.at(MapId{0});
  EXPECT_EQ(report.used, 2 * kRows * kColumns);
  EXPECT_EQ(report.factors.positions.size(), 2 * flight_.size());
  EXPECT_NEAR(report.vertical_rms_m, 0.3, 0.1);
  EXPECT_EQ(made_.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kGeoreferenced);
  const SE3 truth_from_local = LocalFromLocal(kOrigin, report.origin);
  for (const Visit* visit : {&visit_, &again_}) {
    for (size_t i = 0; i < flight_.size(); ++i) {
      const Eigen::Vector3d found =
          truth_from_local * map.At(visit->keyframes[i]).cam_from_world.InverseTranslation();
      EXPECT_LT((found - flight_[i].InverseTranslation()).norm(), 0.4);
    }
  }
}

TEST_F(PlacedMapsTest, HaveOneSpanningTree) {
  ASSERT_EQ(Join(2), 1);
  const Map& map = made_.atlas.At(MapId{0});
  int roots = 0;
  map.keyframes().ForEach([&](const Keyframe& keyframe) { roots += !keyframe.parent.valid(); });
  EXPECT_EQ(roots, 1);
}

TEST_F(PlacedMapsTest, StayTwoWhereFixesHardlyTellTheirPlaces) {
  EXPECT_EQ(Join(0.01), 0);
  EXPECT_EQ(made_.atlas.Remaining().size(), 2u);
  EXPECT_EQ(reports_.size(), 2u);
}

TEST_F(PlacedMapsTest, OneWithoutAPlaceStaysOneOfItsOwn) {
  streams_.gnss.fixes.resize(flight_.size());
  EXPECT_EQ(Join(2), 0);
  EXPECT_EQ(made_.atlas.Remaining().size(), 2u);
  EXPECT_FALSE(reports_.at(MapId{1}).found);
}

}  // namespace
}  // namespace deepuav
