#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "deepuav/map/map.h"
#include "support/synthetic_features.h"

namespace deepuav {

/// A map whose keyframes have `keypoints` random key points each.
class MapBuilder {
 public:
  static constexpr int kDimension = 16;

  MapBuilder(uint64_t seed, int keypoints) : random(seed), keypoints_(keypoints) {}

  KeyframeId AddKeyframe(const SE3& cam_from_world = SE3()) {
    const KeyframeId id = ids.NextKeyframe();
    auto features =
        std::make_shared<const Features>(RandomFeatures(keypoints_, 640, 480, kDimension, &random));
    map.AddKeyframe(id, {FrameId{id.value}, Timestamp{id.value}, features}, cam_from_world);
    return id;
  }
  /// Seen at key point `keypoint` of all of them.
  LandmarkId AddLandmark(const std::vector<KeyframeId>& observers, int keypoint,
                         const Eigen::Vector3d& position = {0, 0, 5}) {
    const LandmarkId id = ids.NextLandmark();
    map.AddLandmark(id, position, observers.back());
    for (KeyframeId observer : observers) EXPECT_TRUE(map.AddObservation(observer, keypoint, id));
    return id;
  }

  Map map{MapId{0}};
  IdSource ids;
  Random random;

 private:
  int keypoints_;
};

inline SE3 RandomPose(Random* random) { return Perturbed(SE3(), random->Uniform(0, 5), 1, random); }

inline double PoseDifference(const SE3& a, const SE3& b) { return (a * b.Inverse()).Log().norm(); }

/// Both sides of every observation agree, and each landmark has two or more.
inline void CheckObservations(const Map& map) {
  map.landmarks().ForEach([&map](const Landmark& landmark) {
    ASSERT_GE(landmark.observations.size(), 2u) << landmark.id.value;
    bool has_representative = false;
    KeyframeId before;
    for (const Observation& o : landmark.observations) {
      ASSERT_LT(before, o.keyframe);
      before = o.keyframe;
      ASSERT_TRUE(map.Contains(o.keyframe));
      ASSERT_EQ(map.At(o.keyframe).landmarks.at(static_cast<size_t>(o.keypoint)), landmark.id);
      has_representative |= o.keyframe == landmark.representative.keyframe &&
                            o.keypoint == landmark.representative.keypoint;
    }
    ASSERT_TRUE(has_representative) << landmark.id.value;
  });
  map.keyframes().ForEach([&map](const Keyframe& keyframe) {
    int count = 0;
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      if (!keyframe.landmarks[i].valid()) continue;
      ++count;
      ASSERT_TRUE(map.Contains(keyframe.landmarks[i]));
      const auto& observations = map.At(keyframe.landmarks[i]).observations;
      ASSERT_EQ(std::count_if(observations.begin(), observations.end(),
                              [&](const Observation& o) {
                                return o.keyframe == keyframe.id && o.keypoint == int(i);
                              }),
                1);
    }
    ASSERT_EQ(keyframe.LandmarkCount(), count);
  });
}

/// The weights are what counting says.
inline void CheckCovisibility(const Map& map) {
  std::map<KeyframeId, std::map<KeyframeId, int>> expected;
  map.landmarks().ForEach([&expected](const Landmark& landmark) {
    for (const Observation& a : landmark.observations) {
      for (const Observation& b : landmark.observations) {
        if (a.keyframe != b.keyframe) ++expected[a.keyframe][b.keyframe];
      }
    }
  });
  map.keyframes().ForEach([&expected](const Keyframe& keyframe) {
    ASSERT_EQ(keyframe.covisible, expected[keyframe.id]) << keyframe.id.value;
  });
}

/// One root, no cycle, parents and children agree.
inline void CheckSpanningTree(const Map& map) {
  int roots = 0;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    roots += !keyframe.parent.valid();
    if (keyframe.parent.valid()) {
      ASSERT_TRUE(map.Contains(keyframe.parent));
      ASSERT_TRUE(map.At(keyframe.parent).children.contains(keyframe.id));
    }
    for (KeyframeId child : keyframe.children) {
      ASSERT_TRUE(map.Contains(child));
      ASSERT_EQ(map.At(child).parent, keyframe.id);
    }
    int steps = 0;
    for (KeyframeId up = keyframe.id; map.At(up).parent.valid(); up = map.At(up).parent) {
      ASSERT_LE(++steps, map.KeyframeCount()) << "a cycle through " << keyframe.id.value;
    }
  });
  ASSERT_EQ(roots, map.KeyframeCount() > 0);
  if (roots > 0) {
    ASSERT_FALSE(map.At(map.root()).parent.valid());
  }
}

/// With other keyframes of the map, both ways.
inline void CheckLoops(const Map& map) {
  map.keyframes().ForEach([&map](const Keyframe& keyframe) {
    for (KeyframeId other : keyframe.loops) {
      ASSERT_NE(other, keyframe.id);
      ASSERT_TRUE(map.Contains(other));
      ASSERT_TRUE(map.At(other).loops.contains(keyframe.id));
    }
  });
}

inline void CheckConsistent(const Map& map) {
  ASSERT_NO_FATAL_FAILURE(CheckObservations(map));
  ASSERT_NO_FATAL_FAILURE(CheckCovisibility(map));
  ASSERT_NO_FATAL_FAILURE(CheckSpanningTree(map));
  ASSERT_NO_FATAL_FAILURE(CheckLoops(map));
}

}  // namespace deepuav
