#include "deepuav/system/sensors/moving_path.h"

#include "deepuav/system/testing/georeferencing_fixture.h"

namespace deepuav {
namespace {

constexpr double kClose = 1e-9;

class MovingPathTest : public GeoreferencingTest {
 protected:
  /// A frame as it is told: where its map has it then.
  FrameRecord Told(size_t i) {
    FrameRecord record = records_[i];
    record.cam_from_world = map().PoseOf(record.pose);
    record.map_revision = map().revision();
    return record;
  }
  SE3 PoseOf(size_t i) { return map().At(visit_.keyframes[i]).cam_from_world; }
};

TEST_F(MovingPathTest, FollowsTheMap) {
  MovingPath path(0);
  for (size_t i = 0; i < 5; ++i) path.Add(Told(i));
  const int64_t before = map().revision();
  map().Transform(Sim3(2, RotationExp({0.1, 0.2, 0.3}), {1, 2, 3}));
  EXPECT_TRUE(path.In(MapId{0}, map().revision()).empty()) << "nobody has told of it";
  path.Follow(map());
  EXPECT_TRUE(path.In(MapId{0}, before).empty());
  const Trajectory moved = path.In(MapId{0}, map().revision());
  ASSERT_EQ(moved.size(), 5u);
  for (size_t i = 0; i < moved.size(); ++i) {
    EXPECT_EQ(moved[i].time, records_[i].time);
    EXPECT_LT((moved[i].world_from_cam.translation() - PoseOf(i).InverseTranslation()).norm(),
              kClose);
  }
}

TEST_F(MovingPathTest, FollowsIntoTheMapThatItsOwnBecomesPartOf) {
  MovingPath path(0);
  for (size_t i = 0; i < 5; ++i) path.Add(Told(i));
  Map other(made_.atlas.NextMap());
  const MapId into = other.id();
  map().Transform(Sim3(0.5, RotationExp({0, 0, 1}), {7, 8, 9}));
  other.Absorb(&map(), KeyframeId());
  path.Follow(other);
  EXPECT_TRUE(path.In(MapId{0}, other.revision()).empty());
  const Trajectory moved = path.In(into, other.revision());
  ASSERT_EQ(moved.size(), 5u);
  EXPECT_LT((moved[3].world_from_cam.translation() -
             other.At(visit_.keyframes[3]).cam_from_world.InverseTranslation())
                .norm(),
            kClose);
}

TEST_F(MovingPathTest, TakesOneOfThoseThatComeCloseAndForgetsTheOld) {
  const double between_s = SecondsBetween(records_[0].time, records_[1].time);
  MovingPath path(2.5 * between_s);
  for (size_t i = 0; i < 10; ++i) path.Add(Told(i));
  const Trajectory thinned = path.In(MapId{0}, map().revision());
  ASSERT_EQ(thinned.size(), 4u);
  EXPECT_EQ(thinned[1].time, records_[3].time);
  path.ForgetBefore(records_[4].time);
  ASSERT_EQ(path.In(MapId{0}, map().revision()).size(), 2u);
}

}  // namespace
}  // namespace deepuav
