#pragma once

#include <map>
#include <optional>
#include <vector>

#include "deepuav/features/moved_features.h"
#include "deepuav/geometry/sim3.h"
#include "deepuav/map/id_store.h"
#include "deepuav/map/keyframe.h"
#include "deepuav/map/landmark.h"

namespace deepuav {

/// Hands out ids that are unique over all maps of an atlas.
struct IdSource {
  KeyframeId NextKeyframe() { return {keyframes++}; }
  LandmarkId NextLandmark() { return {landmarks++}; }

  int64_t keyframes = 0, landmarks = 0;
};

struct MapState;

/// Keyframes and landmarks that observe one another, the covisibility graph and the spanning tree.
/// Every change goes through it, so that both sides of an observation and the covisibility weights
/// always agree. Thread-compatible: one writer, the Mapper; others get copies.
class Map {
 public:
  explicit Map(MapId id) : id_(id) {}
  /// A map from what was saved of it. Throws Error naming the keyframe or landmark where the parts
  /// contradict one another, so that a restored map can be relied on as any other.
  static Map Restore(MapState state);

  MapId id() const { return id_; }
  int KeyframeCount() const { return keyframes_.size(); }
  int LandmarkCount() const { return landmarks_.size(); }

  KeyframeId root() const { return root_; }
  const IdStore<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  const IdStore<LandmarkId, Landmark>& landmarks() const { return landmarks_; }
  /// Of the keyframes that were removed.
  const std::map<KeyframeId, CulledKeyframe>& culled() const { return culled_; }
  /// What landmarks were replaced by, which may have been removed or replaced since.
  const std::map<LandmarkId, LandmarkId>& merged_into() const { return merged_into_; }
  bool Contains(KeyframeId id) const { return keyframes_.Contains(id); }
  bool Contains(LandmarkId id) const { return landmarks_.Contains(id); }
  const Keyframe& At(KeyframeId id) const { return keyframes_.At(id); }
  const Landmark& At(LandmarkId id) const { return landmarks_.At(id); }

  /// Adds a keyframe without observations.
  void AddKeyframe(KeyframeId id, const Frame& frame, const SE3& cam_from_world);
  /// Hangs the keyframe into the spanning tree under the one it shares most landmarks with;
  /// `fallback` where it shares none.
  void ConnectToParent(KeyframeId id, KeyframeId fallback);
  /// Makes the keyframe the root of the spanning tree.
  void Reroot(KeyframeId id);
  /// Ties two keyframes that a closed loop brought together.
  void AddLoop(KeyframeId a, KeyframeId b);
  /// Takes the keyframe and its observations away. Its children move to its parent's side, and its
  /// pose stays known relative to a keyframe that remains. The root cannot be removed.
  void RemoveKeyframe(KeyframeId id);

  void AddLandmark(LandmarkId id, const Eigen::Vector3d& position_world, KeyframeId created_by);
  void RemoveLandmark(LandmarkId id);
  /// Gives the observations of `from` to `into` and remembers the replacement.
  void MergeLandmark(LandmarkId from, LandmarkId into);
  /// The landmark that stands for `id` now; nothing if it was removed.
  std::optional<LandmarkId> Current(LandmarkId id) const;

  /// `measured`: where the keyframe shows the landmark; nothing: at the key point. Does nothing and
  /// returns false when the keyframe has the landmark already, or the key point another.
  bool AddObservation(KeyframeId keyframe, int keypoint, LandmarkId landmark,
                      const std::optional<PixelMeasurement>& measured = std::nullopt);
  /// Of a landmark that the keyframe sees.
  void SetMeasurement(KeyframeId keyframe, LandmarkId landmark, const PixelMeasurement& measured);
  /// A landmark that keeps fewer than two observations is removed.
  void RemoveObservation(KeyframeId keyframe, LandmarkId landmark);

  void SetPose(KeyframeId id, const SE3& cam_from_world) {
    keyframes_.At(id).cam_from_world = cam_from_world;
  }
  /// Its key points where they are for another motion while it was read.
  void SetFrame(KeyframeId id, Frame frame) { keyframes_.At(id).frame = std::move(frame); }
  /// For a keyframe whose key points were corrected for it already.
  void SetMotion(KeyframeId id, const ReadoutMotion& motion) {
    keyframes_.At(id).frame.motion = motion;
  }
  void SetPosition(LandmarkId id, const Eigen::Vector3d& position_world) {
    landmarks_.At(id).position_world = position_world;
  }
  void SetNormal(LandmarkId id, const Eigen::Vector3d& normal_world) {
    landmarks_.At(id).normal_world = normal_world;
  }
  void CountViews(LandmarkId id, int visible, int found);
  /// Renews mean direction and distances after poses or observations changed.
  void UpdateViewRange(LandmarkId id);
  /// Renews the above and the representative: the observation most similar to the others.
  void UpdateAppearance(LandmarkId id);
  /// Moves the keyframe as if the world around it had been transformed: its landmarks stay.
  void Move(KeyframeId id, const Sim3& new_from_old);
  /// Moves everything.
  void Transform(const Sim3& new_from_old);
  /// Gives all key points and measurements other places in the undistorted camera.
  void MovePixels(const PixelMove& move);
  /// Multiplies all lengths by `factor`.
  void Rescale(double factor);
  /// Takes everything over from `other`, which must have been transformed into this one's world.
  /// Its root becomes a child of `parent`.
  void Absorb(Map* other, KeyframeId parent);

  /// Keyframes sharing at least `min_shared` landmarks, most first, at most `max_count`.
  std::vector<KeyframeId> Covisible(KeyframeId id, int min_shared, int max_count) const;

  /// The pose of a keyframe that is or was in the map, through the one it was culled into.
  SE3 PoseOf(KeyframeId id) const { return PoseOf(AnchoredPose{id, SE3(), 1}); }
  /// The same for a camera seen from such a keyframe.
  SE3 PoseOf(const AnchoredPose& pose) const;
  /// The same camera, seen from the keyframe that remains where its own was culled.
  AnchoredPose OnRemaining(const AnchoredPose& pose) const;
  /// By how much all lengths around such a camera have grown since its pose was taken.
  double GrowthSince(const AnchoredPose& pose) const;
  /// The keyframe itself or, if it was culled, the remaining one its pose hangs on.
  KeyframeId Remaining(KeyframeId id) const;

  /// Of what was removed, keeps only where these keyframes were and what stands for these landmarks
  /// now, both by rising id. The others must not be asked for any more.
  void ForgetRemovedBut(const std::vector<KeyframeId>& keyframes,
                        const std::vector<LandmarkId>& landmarks);

  double MedianDepth(KeyframeId id) const;

  /// How often all of it, or a large part, was moved at once: by a loop, a merger, an adjustment of
  /// the whole, another gauge.
  int64_t revision() const { return revision_; }
  void CountMove() { ++revision_; }

  /// What the measurements err by beyond their own noise, as by calibration and shutter: standard
  /// deviation per axis.
  double model_sigma_px() const { return model_sigma_px_; }
  void SetModelSigma(double sigma_px) { model_sigma_px_ = sigma_px; }

 private:
  void RestoreLandmark(Landmark landmark);
  void RestoreCovisibility();
  void ShiftCovisibility(const Landmark& landmark, KeyframeId keyframe, int change);
  void Reparent(const Keyframe& removed);

  void SetParent(KeyframeId id, KeyframeId parent);

  MapId id_;
  double model_sigma_px_ = 0;
  int64_t revision_ = 0;
  KeyframeId root_;
  IdStore<KeyframeId, Keyframe> keyframes_;
  IdStore<LandmarkId, Landmark> landmarks_;
  std::map<KeyframeId, CulledKeyframe> culled_;
  std::map<LandmarkId, LandmarkId> merged_into_;
};

}  // namespace deepuav
