#include "deepuav/map/atlas.h"

#include <gtest/gtest.h>

#include "deepuav/map/map_renumbering.h"
#include "support/map_builder.h"

namespace deepuav {
namespace {

using MapIds = std::vector<MapId>;

/// Maps of two keyframes and a landmark each.
Atlas AtlasOf(int maps) {
  Atlas atlas;
  Random random(1);
  for (int m = 0; m < maps; ++m) {
    Map& map = atlas.Add(Map(atlas.NextMap()));
    const LandmarkId landmark = atlas.ids().NextLandmark();
    std::vector<KeyframeId> ids = {atlas.ids().NextKeyframe(), atlas.ids().NextKeyframe()};
    for (KeyframeId id : ids) {
      const auto features = std::make_shared<const Features>(
          RandomFeatures(3, 640, 480, MapBuilder::kDimension, &random));
      map.AddKeyframe(id, {FrameId{id.value}, {}, features}, RandomPose(&random));
    }
    map.AddLandmark(landmark, {0, 0, double(m)}, ids[1]);
    for (KeyframeId id : ids) map.AddObservation(id, 0, landmark);
    map.ConnectToParent(ids[1], ids[0]);
    map.UpdateAppearance(landmark);
  }
  return atlas;
}

TEST(Atlas, AMergedMapStandsForWhatWasPutIntoIt) {
  Atlas atlas = AtlasOf(4);
  const Map& last = atlas.At(MapId{3});
  atlas.Merge(MapId{1}, MapId{2}, KeyframeId{4});
  EXPECT_EQ(atlas.Current(MapId{1}), MapId{2});
  EXPECT_EQ(atlas.Remaining(), (MapIds{{0}, {2}, {3}}));
  EXPECT_EQ(atlas.BySize(), (MapIds{{2}, {0}, {3}}));
  EXPECT_EQ(&atlas.At(MapId{1}), &atlas.At(MapId{2}));
  EXPECT_EQ(atlas.At(MapId{2}).KeyframeCount(), 4);
  EXPECT_EQ(atlas.At(MapId{2}).At(KeyframeId{2}).parent, KeyframeId{4});

  // Under the name it had before it was merged itself.
  atlas.Merge(MapId{1}, MapId{0}, KeyframeId{1});
  EXPECT_EQ(atlas.Remaining(), (MapIds{{0}, {3}}));
  for (int64_t merged : {1, 2}) EXPECT_EQ(atlas.Current({merged}), MapId{0});
  EXPECT_EQ(atlas.At(MapId{2}).id(), MapId{0});
  EXPECT_EQ(atlas.At(MapId{0}).KeyframeCount(), 6);
  EXPECT_EQ(atlas.At(MapId{0}).LandmarkCount(), 3);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(atlas.At(MapId{0})));
  EXPECT_EQ(atlas.NextMap(), MapId{4}) << "ids are not given twice";

  atlas.Merge(MapId{0}, MapId{3}, KeyframeId{7});
  EXPECT_EQ(atlas.Remaining(), (MapIds{{3}}));
  EXPECT_EQ(atlas.Current(MapId{1}), MapId{3});
  EXPECT_EQ(&atlas.At(MapId{1}), &last) << "references stay valid";
  EXPECT_EQ(last.root(), KeyframeId{6});
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(last));
}

TEST(TakeMaps, CopiesWhatRemainsBehindTheIdsInUse) {
  Atlas other = AtlasOf(3);
  other.At(MapId{2}).AddLoop(KeyframeId{4}, KeyframeId{5});
  other.Merge(MapId{0}, MapId{1}, KeyframeId{2});
  other.At(MapId{1}).RemoveKeyframe(KeyframeId{3});
  Gauge metric;
  metric.kind = GaugeKind::kMetric;
  other.ChangeGauge(MapId{2}, Sim3(), metric);
  other.At(MapId{2}).SetModelSigma(0.25);
  Atlas atlas = AtlasOf(1);
  const auto new_ids = TakeMaps(other, &atlas);
  ASSERT_EQ(atlas.Remaining(), (MapIds{{0}, {1}, {2}}));
  EXPECT_EQ(atlas.ids().keyframes, 2 + 6);
  EXPECT_EQ(atlas.ids().landmarks, 1 + 3);
  EXPECT_EQ(new_ids.size(), 5u) << "those that are there";
  for (const auto& [old_id, new_id] : new_ids) {
    EXPECT_EQ(new_id.value, old_id.value + 2);
    const MapId map{old_id.value < 4 ? 1 : 2};
    EXPECT_LT(PoseDifference(atlas.At(map).PoseOf(new_id), other.At(map).PoseOf(old_id)), 1e-12);
  }
  EXPECT_LT(PoseDifference(atlas.At(MapId{1}).PoseOf(KeyframeId{5}),
                           other.At(MapId{1}).PoseOf(KeyframeId{3})),
            1e-12)
      << "of one that was removed";
  EXPECT_EQ(atlas.GaugeOf(MapId{1}).kind, GaugeKind::kFree);
  EXPECT_EQ(atlas.GaugeOf(MapId{2}).kind, GaugeKind::kMetric) << "what its world means";
  EXPECT_EQ(atlas.At(MapId{2}).model_sigma_px(), 0.25);
  EXPECT_EQ(atlas.At(MapId{2}).At(KeyframeId{6}).loops, std::set<KeyframeId>{{7}});
  EXPECT_EQ(atlas.At(MapId{1}).At(KeyframeId{2}).parent, KeyframeId{4});
  for (MapId map : atlas.Remaining()) ASSERT_NO_FATAL_FAILURE(CheckConsistent(atlas.At(map)));
}

}  // namespace
}  // namespace deepuav
