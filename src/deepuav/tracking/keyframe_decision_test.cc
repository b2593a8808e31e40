#include "deepuav/tracking/keyframe_decision.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

/// One keyframe at the origin that sees 200 landmarks 10 ahead.
LocalMap TwoHundredLandmarks() {
  LocalMap local_map;
  local_map.keyframes.push_back({{0}, SE3(), 1, nullptr, std::vector<int>(300, -1)});
  for (int i = 0; i < 200; ++i) {
    local_map.landmarks.push_back({{i}, {0.01 * i - 1, 0, 10}, {0, 0, -1}, 10, 10, 2});
    local_map.keyframes[0].landmarks[static_cast<size_t>(i)] = i;
  }
  return local_map;
}

/// `sideways` away from the keyframe, sees the first `seen` landmarks.
LocatedFrame Located(int seen, double sideways) {
  LocatedFrame located;
  located.cam_from_world = SE3(Eigen::Quaterniond::Identity(), {-sideways, 0, 0});
  for (int i = 0; i < seen; ++i) located.seen.push_back({i, i});
  located.reference_shared = seen;
  return located;
}

TEST(NeedsKeyframe, NotWhereTheReferenceIsSeenWellFromNearby) {
  EXPECT_FALSE(NeedsKeyframe(Located(190, 0.1), TwoHundredLandmarks(), 5, {}));
  EXPECT_FALSE(NeedsKeyframe(Located(200, 0), TwoHundredLandmarks(), 1000, {}));
}

TEST(NeedsKeyframe, WhereLittleOfTheReferenceIsSeen) {
  EXPECT_FALSE(
      NeedsKeyframe(Located(131, 0), TwoHundredLandmarks(), 5, {.min_shared_ratio = 0.65}));
  EXPECT_TRUE(NeedsKeyframe(Located(129, 0), TwoHundredLandmarks(), 5, {.min_shared_ratio = 0.65}));
}

TEST(NeedsKeyframe, WhereFewAreSeenAtAll) {
  KeyframeOptions options{.min_shared_ratio = 0, .min_matches = 80};
  EXPECT_TRUE(NeedsKeyframe(Located(79, 0), TwoHundredLandmarks(), 5, options));
  EXPECT_FALSE(NeedsKeyframe(Located(80, 0), TwoHundredLandmarks(), 5, options));
  EXPECT_TRUE(NeedsKeyframe(Located(0, 0), TwoHundredLandmarks(), 5, options));
}

TEST(NeedsKeyframe, WhereTheParallaxIsLarge) {
  KeyframeOptions options{.max_parallax_deg = 4};
  EXPECT_FALSE(NeedsKeyframe(Located(200, 0.68), TwoHundredLandmarks(), 5, options));
  EXPECT_TRUE(NeedsKeyframe(Located(200, 0.72), TwoHundredLandmarks(), 5, options));
}

TEST(NeedsKeyframe, NeverBeforeTheGap) {
  KeyframeOptions options{.min_gap_frames = 4};
  EXPECT_FALSE(NeedsKeyframe(Located(10, 2), TwoHundredLandmarks(), 3, options));
  EXPECT_TRUE(NeedsKeyframe(Located(10, 2), TwoHundredLandmarks(), 4, options));
}

TEST(KeyframeOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(KeyframeOptions().Check());
  EXPECT_THROW((KeyframeOptions{.min_shared_ratio = 1.1}.Check()), Error);
  EXPECT_THROW((KeyframeOptions{.min_matches = -1}.Check()), Error);
  EXPECT_THROW((KeyframeOptions{.max_parallax_deg = 0}.Check()), Error);
  EXPECT_THROW((KeyframeOptions{.min_gap_frames = 0}.Check()), Error);
}

}  // namespace
}  // namespace deepuav
