// A map under random operations.

#include <gtest/gtest.h>

#include <algorithm>

#include "support/map_builder.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr int kDimension = MapBuilder::kDimension;

/// Does random things to a map, and knows what poses and landmarks must have become of them.
class RandomEditor {
 public:
  explicit RandomEditor(uint64_t seed) : builder_(seed, 40) { AddKeyframe(); }

  void Step() {
    switch (random().Index(26)) {
      case 0:
        return AddKeyframe();
      case 1:
        return RemoveKeyframe();
      case 2:
        return RemoveObservation();
      case 3:
        return RemoveLandmark();
      case 4:
      case 5:
        return Merge();
      case 6:
        return random().Index(2) ? MoveWorld() : Rescale();
      case 24:
        return builder_.map.Reroot(AnyKeyframe());
      case 25:
        return builder_.map.AddLoop(AnyKeyframe(), AnyKeyframe());
      case 7:
      case 8:
      case 9:
        return AddObservation();
      default:
        return AddLandmark();
    }
  }

  void CheckPosesAndLandmarks() const {
    for (const auto& [id, pose] : poses_) {
      ASSERT_LT(PoseDifference(map().PoseOf(id), pose), 1e-6) << id.value;
      ASSERT_TRUE(map().Contains(map().Remaining(id)));
      ASSERT_EQ(map().Contains(id), map().Remaining(id) == id);
    }
    for (const LandmarkId id : landmarks_) {
      LandmarkId end = id;
      while (merged_.contains(end)) end = merged_.at(end);
      const auto current = map().Current(id);
      ASSERT_EQ(current.has_value(), map().Contains(end));
      if (current) {
        ASSERT_EQ(*current, end);
      }
    }
  }

  const Map& map() const { return builder_.map; }

 private:
  Random& random() { return builder_.random; }

  KeyframeId AnyKeyframe() {
    std::vector<KeyframeId> all;
    map().keyframes().ForEach([&all](const Keyframe& k) { all.push_back(k.id); });
    return all[static_cast<size_t>(random().Index(static_cast<int>(all.size())))];
  }
  LandmarkId AnyLandmark() {
    std::vector<LandmarkId> all;
    map().landmarks().ForEach([&all](const Landmark& l) { all.push_back(l.id); });
    if (all.empty()) return {};
    return all[static_cast<size_t>(random().Index(static_cast<int>(all.size())))];
  }

  void AddKeyframe() {
    if (map().KeyframeCount() >= 25) return;
    const SE3 pose = RandomPose(&random());
    const KeyframeId fallback = map().KeyframeCount() > 0 ? AnyKeyframe() : KeyframeId{};
    const KeyframeId id = builder_.AddKeyframe(pose);
    poses_[id] = pose;
    if (!fallback.valid()) return;
    for (int i = 0; i < 10; ++i) {
      const LandmarkId landmark = AnyLandmark();
      if (landmark.valid()) builder_.map.AddObservation(id, random().Index(40), landmark);
    }
    builder_.map.ConnectToParent(id, fallback);
  }
  void RemoveKeyframe() {
    const KeyframeId id = AnyKeyframe();
    if (map().At(id).parent.valid()) builder_.map.RemoveKeyframe(id);
  }
  void AddLandmark() {
    const KeyframeId a = AnyKeyframe(), b = AnyKeyframe();
    const int at_a = random().Index(40), at_b = random().Index(40);
    if (a == b || map().At(a).landmarks[static_cast<size_t>(at_a)].valid() ||
        map().At(b).landmarks[static_cast<size_t>(at_b)].valid()) {
      return;
    }
    const LandmarkId id = builder_.ids.NextLandmark();
    landmarks_.push_back(id);
    builder_.map.AddLandmark(id, 5 * RandomDirection(&random()), a);
    ASSERT_TRUE(builder_.map.AddObservation(a, at_a, id));
    ASSERT_TRUE(builder_.map.AddObservation(b, at_b, id));
  }
  void AddObservation() {
    const LandmarkId id = AnyLandmark();
    if (!id.valid()) return;
    const KeyframeId keyframe = AnyKeyframe();
    const int keypoint = random().Index(40);
    const bool taken = map().At(keyframe).landmarks[static_cast<size_t>(keypoint)].valid();
    const auto& observations = map().At(id).observations;
    const bool seen = std::any_of(observations.begin(), observations.end(),
                                  [&](const Observation& o) { return o.keyframe == keyframe; });
    ASSERT_EQ(builder_.map.AddObservation(keyframe, keypoint, id), !taken && !seen);
    builder_.map.UpdateAppearance(id);
  }
  void RemoveObservation() {
    const LandmarkId id = AnyLandmark();
    if (id.valid()) builder_.map.RemoveObservation(AnyKeyframe(), id);
  }
  void RemoveLandmark() {
    const LandmarkId id = AnyLandmark();
    if (id.valid()) builder_.map.RemoveLandmark(id);
  }
  void Merge() {
    const LandmarkId from = AnyLandmark(), into = AnyLandmark();
    if (!from.valid()) return;
    builder_.map.MergeLandmark(from, into);
    if (from != into) merged_[from] = into;
  }
  void MoveWorld() {
    const SE3 new_from_old = RandomPose(&random());
    builder_.map.Transform(Sim3(new_from_old));
    for (auto& entry : poses_) entry.second = entry.second * new_from_old.Inverse();
  }
  void Rescale() {
    const double factor = random().Index(2) ? 1.25 : 0.8;
    builder_.map.Rescale(factor);
    for (auto& entry : poses_) {
      entry.second = SE3(entry.second.rotation(), factor * entry.second.translation());
    }
  }

  MapBuilder builder_;
  std::map<KeyframeId, SE3> poses_;
  std::vector<LandmarkId> landmarks_;
  std::map<LandmarkId, LandmarkId> merged_;
};

TEST(Map, StaysConsistentUnderRandomOperations) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    RandomEditor editor(seed);
    int most_keyframes = 0, most_landmarks = 0;
    for (int step = 0; step < 4000; ++step) {
      ASSERT_NO_FATAL_FAILURE(editor.Step());
      most_keyframes = std::max(most_keyframes, editor.map().KeyframeCount());
      most_landmarks = std::max(most_landmarks, editor.map().LandmarkCount());
      SCOPED_TRACE(step);
      if (step % 7 == 0) {
        ASSERT_NO_FATAL_FAILURE(CheckConsistent(editor.map()));
      }
      if (step % 50 == 0) {
        ASSERT_NO_FATAL_FAILURE(editor.CheckPosesAndLandmarks());
      }
    }
    EXPECT_GT(most_keyframes, 10);
    EXPECT_GT(most_landmarks, 40);
  }
}

}  // namespace
}  // namespace deepuav
