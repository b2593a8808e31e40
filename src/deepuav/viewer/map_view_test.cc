#include "deepuav/viewer/map_view.h"

#include <gtest/gtest.h>

#include "support/map_builder.h"

namespace deepuav {
namespace {

SE3 At(double x) { return SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0)); }

TEST(MapView, SaysWhichWayIsUp) {
  const Map map(MapId{0});
  EXPECT_EQ(ViewOf(map, GaugeKind::kFree).up, Eigen::Vector3f(0, -1, 0));
  EXPECT_EQ(ViewOf(map, GaugeKind::kMetric).up, Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(ViewOf(map, GaugeKind::kGeoreferenced).up, Eigen::Vector3f(0, 0, 1));
}

TEST(MapView, HoldsTheLoopsOfTheKeyframesThatAreThere) {
  MapBuilder builder(1, 1);
  std::vector<KeyframeId> ids;
  for (int i = 0; i < 5; ++i) ids.push_back(builder.AddKeyframe(At(i)));
  builder.map.AddLoop(ids[0], ids[3]);
  builder.map.AddLoop(ids[4], ids[1]);
  EXPECT_TRUE(ViewOf(builder.map, GaugeKind::kFree, ids[2]).loops.empty());
  EXPECT_EQ(ViewOf(builder.map, GaugeKind::kFree, ids[3]).loops.size(), 1u);
  const auto loops = ViewOf(builder.map, GaugeKind::kFree).loops;
  ASSERT_EQ(loops.size(), 2u);  // Each of them once.
  EXPECT_EQ(loops[0][0], Eigen::Vector3f(0, 0, 0));
  EXPECT_EQ(loops[0][1], Eigen::Vector3f(3, 0, 0));
  EXPECT_EQ(loops[1][0], Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(loops[1][1], Eigen::Vector3f(4, 0, 0));
}

TEST(MapView, HoldsSoManyLoopsAtMost) {
  constexpr int kKeyframes = 50;
  constexpr size_t kMost = 500;
  MapBuilder builder(1, 1);
  std::vector<KeyframeId> ids;
  for (int i = 0; i < kKeyframes; ++i) {
    const KeyframeId added = builder.AddKeyframe(At(i));
    for (const KeyframeId id : ids) builder.map.AddLoop(added, id);
    ids.push_back(added);
  }
  const size_t shown = ViewOf(builder.map, GaugeKind::kFree).loops.size();
  EXPECT_LE(shown, kMost);
  EXPECT_GT(shown, kMost / 2);
}

}  // namespace
}  // namespace deepuav
