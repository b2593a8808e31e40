#include "deepuav/assembly/maps/map_joining.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/map/map_renumbering.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/path_error.h"
#include "support/synthetic_court.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.2, 0, 20};

/// Two flights, each with a map of its own, in one atlas: the second one's numbers follow the
/// first's.
class MapJoiningTest : public testing::Test {
 protected:
  /// Returns the second flight's map.
  MapId Fly(const SyntheticFlight& first, const SyntheticFlight& second) {
    camera_ = first.camera;
    SyntheticFlight both = first;
    Append(second, &both);
    vocabulary_.emplace(VocabularyOf(both));
    for (const SyntheticFlight* flight : {&first, &second}) {
      PreparedFeatures extractor(flight->features);
      NumberedImages images(flight->size(), flight->frame_interval_s);
      Slam slam(flight->camera, {}, {&extractor, &matcher_});
      EXPECT_EQ(slam.Run(&images, Schedule::kSequential).failure, "");
      TakeMaps(slam.atlas(), &atlas_);
    }
    EXPECT_EQ(atlas_.Remaining().size(), 2u);
    return atlas_.Remaining().back();
  }

  JoiningReport Join(MapId newer) {
    return JoinMaps(camera_, {}, {nullptr, &matcher_, &*vocabulary_}, {newer}, &atlas_);
  }

  /// Of the keyframes of all maps that remain, in one frame; `flights` in the order flown.
  double KeyframeError(const std::vector<SyntheticFlight>& flights, int first_keyframes) const {
    std::vector<Eigen::Vector3d> estimate, truth;
    for (MapId map : atlas_.Remaining()) {
      atlas_.At(map).keyframes().ForEach([&](const Keyframe& keyframe) {
        const SyntheticFlight& flight = flights[keyframe.id.value < first_keyframes ? 0 : 1];
        const auto frame = static_cast<size_t>(keyframe.frame.id.value);
        estimate.push_back(keyframe.cam_from_world.InverseTranslation());
        truth.push_back(flight.cam_from_world[frame].InverseTranslation());
      });
    }
    return RmseAfterAlignment(estimate, truth);
  }

  Camera camera_;
  NearestNeighbourMatcher matcher_{{}};
  std::optional<Vocabulary> vocabulary_;
  Atlas atlas_;
};

int LargestKeyframe(const Map& map) {
  int largest = -1;
  map.keyframes().ForEach([&](const Keyframe& k) { largest = std::max(largest, int(k.id.value)); });
  return largest;
}

TEST_F(MapJoiningTest, JoinsMapsThatShowTheSamePlace) {
  const FeatureWorld world = Court(8);
  const std::vector<SyntheticFlight> flights = {MakeFlight(world, Walk(0, 100), kNoise, 3),
                                                MakeFlight(world, Walk(0.15, 110), kNoise, 4)};
  const MapId newer = Fly(flights[0], flights[1]);
  const int first_keyframes = LargestKeyframe(atlas_.At(atlas_.Remaining().front())) + 1;
  const JoiningReport report = Join(newer);
  EXPECT_EQ(report.merged_maps, 1);
  ASSERT_EQ(atlas_.Remaining().size(), 1u);
  EXPECT_GT(LargestKeyframe(atlas_.At(atlas_.Remaining().front())), first_keyframes);
  EXPECT_LT(KeyframeError(flights, first_keyframes), 0.05);
}

TEST_F(MapJoiningTest, KeepsMapsOfDifferentPlacesApart) {
  const MapId newer = Fly(MakeFlight(Court(8), Walk(0, 80), kNoise, 3),
                          MakeFlight(Court(9), Walk(0, 80), kNoise, 4));
  const JoiningReport report = Join(newer);
  EXPECT_EQ(report.merged_maps + report.closed_loops, 0);
  EXPECT_EQ(atlas_.Remaining().size(), 2u);
}

TEST_F(MapJoiningTest, NeedsAVocabulary) {
  EXPECT_THROW(JoinMaps(camera_, {}, {nullptr, &matcher_}, {}, &atlas_), Error);
}

}  // namespace
}  // namespace deepuav
