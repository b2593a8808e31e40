#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/base/option_bounds.h"
#include "deepuav/localisation/frame_locator.h"
#include "deepuav/localisation/relocaliser.h"
#include "deepuav/map/requests.h"
#include "deepuav/tracking/initialiser.h"
#include "deepuav/tracking/keyframe_decision.h"
#include "deepuav/tracking/motion_model.h"
#include "deepuav/tracking/tracked_pose.h"

namespace deepuav {

struct TrackingOptions {
  int max_lost_frames = 30;  ///< Lost for longer: a new map is started...
  double max_lost_s = 1;     ///< ...likewise.
  bool starts_maps = true;   ///< False: only in maps that are there.
  InitialiserOptions initialiser;
  LocatorOptions locator;
  KeyframeOptions keyframes;
  MotionOptions motion;
  RelocaliserOptions relocaliser;  ///< Of lost frames, by who finds them.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_lost_frames", max_lost_frames, "",
          "frames without a pose after which a new map is started", Between(0, 1'000'000));
    visit("max_lost_s", max_lost_s, "s", "time since the last pose with which a new map is started",
          Between(0, 1e6));
    visit.Part("", locator);  // initialiser and keyframes have names of their own
    visit.Part("motion", motion);
    visit.Part("relocaliser", relocaliser);
  }
};

enum class TrackingState { kInitialising, kTracking, kLost };

/// What became of one frame.
struct TrackingResult {
  TrackingState state = TrackingState::kInitialising;
  std::optional<TrackedPose> pose;
  std::string reason;  ///< Why there is no pose.
  std::optional<InitialMapRequest>
      initial_map;  ///< To be answered with Begin(), then the frame tracked again.
  std::optional<KeyframeRequest> keyframe;  ///< To be answered with UseLocalMap().
};

/// One frame in, one pose out. Holds no map: it works on the LocalMap given to it.
/// Thread-compatible.
class Tracker {
 public:
  /// `matcher` and `stages` (may be null) must outlive it.
  Tracker(const Camera& camera, const TrackingOptions& options, Matcher* matcher,
          StageListener* stages);

  /// `mapping_idle`: a keyframe may be requested.
  TrackingResult Track(const Frame& frame, bool mapping_idle);

  /// Starts tracking in a new map.
  void Begin(std::shared_ptr<const LocalMap> local_map);
  /// Goes on where a frame was found without a prediction; asks for a keyframe there, so that the
  /// surroundings get to know how they look now.
  TrackingResult Resume(const Frame& frame, std::shared_ptr<const LocalMap> local_map,
                        const LocatedFrame& located);
  /// Goes on with a newer copy of the surroundings, which may have become part of another map;
  /// poses move with their reference keyframe.
  void UseLocalMap(std::shared_ptr<const LocalMap> local_map);
  /// What it tracks in; null before the first map.
  const LocalMap* local_map() const { return local_map_.get(); }

 private:
  TrackingResult Initialise(const Frame& frame);
  TrackingResult TrackInMap(const Frame& frame, bool mapping_idle);
  TrackingResult Lost(const Frame& frame, std::string reason);
  LocationPrior PriorFor(const Frame& frame) const;
  KeyframeRequest RequestKeyframe(const Frame& frame, const TrackedPose& pose);
  void CountViews(const LocatedFrame& located);

  const TrackingOptions options_;
  StageListener* stages_;
  Initialiser initialiser_;
  FrameLocator locator_;
  MotionModel motion_;
  TrackingState state_ = TrackingState::kInitialising;
  std::shared_ptr<const LocalMap> local_map_;
  std::optional<TrackedPose> last_;
  int lost_frames_ = 0;
  std::optional<Timestamp> last_time_;  ///< Of the newest frame with a pose.
  FrameId last_keyframe_;
  std::map<LandmarkId, ViewCount> views_;
};

}  // namespace deepuav
