#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_record.h"
#include "support/straight_flight.h"

namespace deepuav {

/// A map and records of a camera that shakes while its rows are read one after the other, both
/// with all true but for where the rows' own cameras saw the landmarks.
class ShakenFlight : protected StraightFlight {
 protected:
  static constexpr double kReadoutS = 0.02;

  void Fly(double shaking_hz, double step_s) {
    shaking_hz_ = shaking_hz;
    step_s_ = step_s;
    camera_.readout_s = kReadoutS;
    std::vector<SE3> poses;
    std::vector<SyntheticView> views;
    for (int k = 0; k < kFrames; k += kFramesAKeyframe) {
      poses.push_back(Shaken(k));
      views.push_back(ReadByRows(k));
    }
    Map map(MapId{0});
    IdSource ids;
    keyframes_ = MapViews(views, poses, world_.landmarks(), &map, &ids, &landmark_of_);
    for (size_t k = 0; k < keyframes_.size(); ++k) {
      Frame frame = map.At(keyframes_[k]).frame;
      frame.id = FrameId{static_cast<int64_t>(k) * kFramesAKeyframe};
      frame.time = TimeOf(static_cast<double>(frame.id.value));
      map.SetFrame(keyframes_[k], frame);
    }
    atlas_.Add(std::move(map));
    for (int i = 0; i < kFrames; ++i) records_.push_back(Tracked(i));
  }

  /// About all axes, at frequencies from half of the given one on.
  SE3 Shaken(double frame) const {
    Eigen::Vector3d shake = Eigen::Vector3d::Zero();
    for (int k = 0; k < 6; ++k) {
      const double phase = 2 * std::numbers::pi * (1 - 0.1 * k) * shaking_hz_ * frame * step_s_;
      shake += 0.008 * Eigen::Vector3d(std::sin(phase + k), std::cos(phase), std::sin(phase - k));
    }
    return SE3(RotationExp(shake), Eigen::Vector3d::Zero()) * PoseAt(frame);
  }

  Timestamp TimeOf(double frame) const {
    return {static_cast<int64_t>(std::llround(1e9 * frame * step_s_))};
  }

  /// The image, in whose every row another camera saw what it shows.
  SyntheticView ReadByRows(int frame) {
    SyntheticView view = world_.View(Shaken(frame), {}, &random_);
    Features features = *view.features;
    for (size_t i = 0; i < features.keypoints.size(); ++i) {
      Keypoint& keypoint = features.keypoints[i];
      const Eigen::Vector3d& point = world_.landmarks()[static_cast<size_t>(view.landmark[i])];
      for (int round = 0; round < 4; ++round) {
        const double moment = RowMoment(keypoint.px.y(), camera_.height);
        const SE3 row_from_world = Shaken(frame + moment * row_readout_s_ / step_s_);
        keypoint.px = camera_.pinhole.Project(row_from_world * point).cast<float>();
      }
      const Eigen::Vector2d noise(random_.Gaussian(noise_px_), random_.Gaussian(noise_px_));
      keypoint.px += noise.cast<float>();
      keypoint.image_px = keypoint.px;
    }
    view.features = std::make_shared<const Features>(features);
    return view;
  }

  FrameRecord Tracked(int i) {
    const SyntheticView view = ReadByRows(i);
    FrameRecord record;
    record.id = FrameId{i};
    record.time = TimeOf(i);
    record.map = MapId{0};
    const Keyframe& near = atlas_.At(record.map).At(keyframes_[KeyframeOf(i)]);
    record.pose = {near.id, Shaken(i) * near.cam_from_world.Inverse(), 1};
    record.features = view.features;
    for (size_t k = 0; k < view.landmark.size(); ++k) {
      const LandmarkId landmark = landmark_of_[static_cast<size_t>(view.landmark[k])];
      if (landmark.valid())
        record.seen.push_back({landmark, {view.features->keypoints[k].px, 0.3F}});
    }
    return record;
  }

  /// Root mean square, of where the middle row would have seen it.
  double ErrorPx(const FrameRecord& record) const {
    double squared = 0;
    const Map& map = atlas_.At(MapId{0});
    for (const FrameRecord::Seen& seen : record.seen)
      squared += SquaredErrorPx(map.PoseOf(record.pose), seen.landmark, seen.measured);
    return std::sqrt(squared / static_cast<double>(record.seen.size()));
  }
  double ErrorPx(const Keyframe& keyframe) const {
    double squared = 0;
    int count = 0;
    for (const LandmarkId landmark : keyframe.landmarks) {
      if (!landmark.valid()) continue;
      const auto& observations = atlas_.At(MapId{0}).At(landmark).observations;
      const Observation& seen =
          *std::ranges::find(observations, keyframe.id, &Observation::keyframe);
      squared += SquaredErrorPx(keyframe.cam_from_world, landmark, seen.measured);
      ++count;
    }
    return std::sqrt(squared / count);
  }
  double SquaredErrorPx(const SE3& cam_from_world, LandmarkId landmark,
                        const PixelMeasurement& measured) const {
    const Eigen::Vector3d point = cam_from_world * atlas_.At(MapId{0}).At(landmark).position_world;
    return (camera_.pinhole.Project(point) - measured.px.cast<double>()).squaredNorm();
  }

  const FeatureWorld world_{Ground(), 2};
  Camera camera_ = world_.camera();
  double shaking_hz_ = 0, step_s_ = 0;
  double row_readout_s_ = kReadoutS;  ///< 0: the camera reads all rows at once after all.
  double noise_px_ = 0;
  Random random_{3};
  Atlas atlas_;
  std::vector<KeyframeId> keyframes_;
  std::vector<LandmarkId> landmark_of_;
  std::vector<FrameRecord> records_;
};

}  // namespace deepuav
