#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "support/synthetic_map.h"

namespace deepuav {

/// A flight past a long box of landmarks whose frames are handed to a Mapper.
class MapperTest : public testing::Test {
 protected:
  static constexpr FeatureNoise kNoise{0.5, 0.3, 0, 30};

  explicit MapperTest(const MappingOptions& options = {}) : options_(options) {}

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(1800, {-10, -5, 7}, {50, 5, 15}, &random);
    return FeatureWorld(geometry, 2);
  }
  static SE3 Truth(int frame) {
    const double x = 1.6 * frame;
    return SE3(RotationExp({0, 0.01 * std::sin(0.3 * x), 0}),
               Eigen::Vector3d(-x, 0.2 * std::sin(0.5 * x), 0));
  }

  const SyntheticView& View(int frame) {
    while (static_cast<int>(views_.size()) <= frame) {
      views_.push_back(world_.View(Truth(static_cast<int>(views_.size())), kNoise, &random_));
    }
    return views_[static_cast<size_t>(frame)];
  }
  int KeypointOf(int frame, int landmark) {
    const std::vector<int>& shown = View(frame).landmark;
    const auto place = std::find(shown.begin(), shown.end(), landmark);
    return place == shown.end() ? -1 : static_cast<int>(place - shown.begin());
  }

  /// The two views, with true geometry in units of the baseline.
  InitialMapRequest FirstViews(int first, int second) {
    const SE3 motion = Truth(second) * Truth(first).Inverse();
    const double scale = 1 / motion.translation().norm();
    InitialMapRequest request{FrameOf(first, View(first)),
                              FrameOf(second, View(second)),
                              SE3(motion.rotation(), scale * motion.translation()),
                              {}};
    for (size_t i = 0; i < View(first).landmark.size(); ++i) {
      const int landmark = View(first).landmark[i];
      const int there = landmark < 0 ? -1 : KeypointOf(second, landmark);
      if (there < 0) continue;
      const Eigen::Vector3d position =
          Truth(first) * world_.landmarks()[static_cast<size_t>(landmark)];
      request.points.push_back({scale * position, static_cast<int>(i), there});
    }
    return request;
  }

  /// A request for frame `frame`, as if tracked with a small error against the newest keyframe:
  /// matches are the landmarks of the local map that it sees.
  KeyframeRequest Request(int frame, const LocalMap& local_map) {
    const LocalKeyframe& reference = local_map.keyframes[static_cast<size_t>(local_map.centre)];
    const int reference_frame =
        static_cast<int>(atlas_.At(local_map.map).At(reference.id).frame.id.value);
    SE3 motion = Truth(frame) * Truth(reference_frame).Inverse();
    motion = SE3(motion.rotation(), motion.translation() / depth_);
    KeyframeRequest request{
        local_map.map,
        FrameOf(frame, View(frame)),
        {reference.id, Perturbed(motion, 0.002, 0.001, &random_), reference.scale},
        {},
        {}};
    for (const LocalLandmark& landmark : local_map.landmarks) {
      const Landmark& whole = atlas_.At(local_map.map).At(landmark.id);
      const Observation& o = whole.representative;
      const auto of = static_cast<int>(atlas_.At(local_map.map).At(o.keyframe).frame.id.value);
      const int shown = View(of).landmark[static_cast<size_t>(o.keypoint)];
      const int keypoint = shown < 0 ? -1 : KeypointOf(frame, shown);
      if (keypoint < 0) continue;
      request.matches.push_back({keypoint, landmark.id});
      request.views.push_back({landmark.id, 1, 1});
    }
    return request;
  }

  std::shared_ptr<const LocalMap> Start() {
    auto local_map = mapper_.StartMap(FirstViews(0, 1));
    std::vector<double> depths;
    for (size_t i = 0; i < View(0).landmark.size(); ++i) {
      const int landmark = View(0).landmark[i];
      if (landmark >= 0 && KeypointOf(1, landmark) >= 0) {
        depths.push_back((Truth(0) * world_.landmarks()[static_cast<size_t>(landmark)]).z());
      }
    }
    std::nth_element(depths.begin(), depths.begin() + static_cast<long>(depths.size() / 2),
                     depths.end());
    depth_ = depths[depths.size() / 2];
    return local_map;
  }
  const Map& map() const { return atlas_.At(atlas_.Remaining().back()); }

  const FeatureWorld world_ = MakeWorld();
  Random random_{3};
  std::vector<SyntheticView> views_;
  Atlas atlas_;
  const MappingOptions options_;
  Mapper mapper_{world_.camera(), options_, &atlas_, nullptr};
  double depth_ = 1;  ///< True length of the map's unit.
};

}  // namespace deepuav
