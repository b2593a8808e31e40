#pragma once

#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/stages.h"
#include "deepuav/estimation/poses/absolute_pose.h"
#include "deepuav/estimation/poses/motion_only.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/map/local_map.h"
#include "deepuav/map/requests.h"
#include "deepuav/map/visibility.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/matching/projection.h"
#include "deepuav/patches/patch_alignment.h"

namespace deepuav {

struct LocatorOptions {
  double predicted_radius_px =
      15;  ///< Search window around the pixel predicted by the motion model.
  double reckoned_radius_px = 40;  ///< The same, once frames before it had no pose.
  double local_radius_px = 6;      ///< Search window once the pose is known from the first matches.
  int min_predicted_inliers =
      20;  ///< Fewer: the prediction is given up for the reference keyframe.
  double min_predicted_ratio = 0.5;  ///< Inliers over matches of the prediction; less: likewise.
  double min_predicted_share = 0.5;  ///< Landmarks seen over those of the neighbouring frame; less:
                                     ///< the prediction must prove itself against the reference.
  /// Landmarks seen over those expected in the view of a pose found without a prediction; less: the
  /// pose is chance.
  double min_unpredicted_ratio = 0.05;
  int min_inliers = 25;     ///< Fewer at the end: not located.
  int reference_tries = 3;  ///< Keyframes matched without prediction before giving up.
  int local_rounds =
      3;  ///< Times at most that the local map is matched, each from a better pose...
  double min_round_growth = 1.1;  ///< ...as long as so many times more is seen.
  PatchOptions patches;
  VisibilityOptions visibility;
  ProjectionOptions projection;
  AbsolutePoseOptions absolute_pose;
  MotionOnlyOptions motion_only;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("predicted_radius_px", predicted_radius_px, "px",
          "search window around a predicted pixel", Above(0, 10'000));
    visit("reckoned_radius_px", reckoned_radius_px, "px",
          "search window around a pixel predicted over frames without a pose", Above(0, 10'000));
    visit("local_radius_px", local_radius_px, "px", "search window around a local landmark's pixel",
          Above(0, 10'000));
    visit("min_predicted_inliers", min_predicted_inliers, "",
          "inliers below which a prediction is given up", Between(4, 100'000));
    visit("min_predicted_ratio", min_predicted_ratio, "",
          "inliers over matches below which a prediction is given up", Between(0, 1));
    visit("min_predicted_share", min_predicted_share, "",
          "landmarks seen over those of the frame before, below which a prediction must prove "
          "itself",
          Between(0, 1));
    visit("min_unpredicted_ratio", min_unpredicted_ratio, "",
          "landmarks seen over those expected in the view, below which a pose found without a "
          "prediction is chance",
          Between(0, 1));
    visit("min_inliers", min_inliers, "", "landmarks a located frame sees at least",
          Between(6, 100'000));
    visit("reference_tries", reference_tries, "",
          "keyframes matched without prediction before giving up", Between(1, 100));
    visit("local_rounds", local_rounds, "",
          "times at most that the local map is matched, each from a better pose", Between(1, 20));
    visit("min_round_growth", min_round_growth, "",
          "landmarks seen over those of the round before from which another one follows",
          Between(1, 100));
    visit.Part("visibility", visibility);
    visit.Part("projection", projection);
    visit.Part("absolute_pose", absolute_pose);
    visit.Part("motion_only", motion_only);
  }
};

/// A frame's pose and the landmarks it sees.
struct LocatedFrame {
  struct Seen {
    int keypoint = 0;
    int landmark = 0;                               ///< Index into LocalMap::landmarks.
    std::optional<PixelMeasurement> measured = {};  ///< Nothing: at the key point.
  };
  SE3 cam_from_world;
  /// As of MotionOnlyResult: what its pixels tell of the pose in a map that is taken as it is.
  Matrix6d information = Matrix6d::Zero();
  std::vector<Seen> seen;    ///< Inliers, by key point.
  std::vector<int> visible;  ///< Landmarks expected in the view, by index.
  Frame frame;               ///< As given, corrected for how the camera moved while it was read.
  int reference = 0;  ///< Index into LocalMap::keyframes: shares most landmarks with the frame.
  int reference_shared = 0;  ///< How many.
};

/// What is known of a frame before it is matched.
struct LocationPrior {
  std::optional<SE3> cam_from_world;
  /// Carried on over frames without a pose: looked for more widely, and to show as much as a pose
  /// found without it.
  bool is_reckoned = false;
  std::vector<LandmarkId>
      landmarks;         ///< Seen by the neighbouring frame, by id; where a prediction looks first.
  KeyframeId reference;  ///< Matched first where the prediction fails.
  /// Another frame near in time, from which it follows how a camera moves within its readout.
  std::optional<TimedPose> neighbour = {};
};

/// A pose and the landmarks that agree with it.
struct CoarsePose {
  SE3 cam_from_world;
  std::vector<LocatedFrame::Seen> seen;
  Matrix6d information = Matrix6d::Zero();  ///< As LocatedFrame's.
};

/// Finds a frame's pose in a local map: by prediction, else by matching a reference keyframe; then
/// with all local landmarks. Thread-compatible; keeps nothing between frames but buffers.
class FrameLocator {
 public:
  /// `matcher` and `stages` (may be null) must outlive it.
  FrameLocator(const Camera& camera, const LocatorOptions& options, Matcher* matcher,
               StageListener* stages);

  /// Nothing when too few landmarks agree; `reason` (if given) then says what failed.
  std::optional<LocatedFrame> Locate(const Frame& frame, const LocalMap& local_map,
                                     const LocationPrior& prior, std::string* reason = nullptr);

  /// The pose from matches found without knowing it, many of which may be wrong. Nothing when too
  /// few agree.
  std::optional<CoarsePose> LocateByMatches(const Frame& frame, const LocalMap& local_map,
                                            const std::vector<LocatedFrame::Seen>& matches) const;

  /// Matches the landmarks that `coarse` does not see yet in windows of `radius_px` around where
  /// they are expected, and optimises the pose on all. `grid` is of the frame's features.
  LocatedFrame Refine(const Frame& frame, const KeypointGrid& grid, const LocalMap& local_map,
                      const CoarsePose& coarse, double radius_px) const;

 private:
  /// Refine again and again, as long as a better pose shows clearly more.
  LocatedFrame RefineInRounds(const Frame& frame, const KeypointGrid& grid,
                              const LocalMap& local_map, const CoarsePose& coarse) const;
  using SeenList = std::vector<LocatedFrame::Seen>;

  std::optional<CoarsePose> FollowPrediction(const Frame& frame, const KeypointGrid& grid,
                                             const LocalMap& local_map,
                                             const LocationPrior& prior) const;
  /// Measures what the frame sees by patches, and the pose with it.
  void Sharpen(const LocalMap& local_map, LocatedFrame* located) const;
  /// Whether a frame shows so little beside its neighbour that its matches may be chance.
  bool IsDoubtful(const LocatedFrame& located, const LocationPrior& prior) const;
  std::optional<CoarsePose> MatchReference(const Frame& frame, const LocalMap& local_map,
                                           const LocationPrior& prior);
  /// The frame of a camera that was at `cam_from_world`.
  Frame Moving(const Frame& frame, const SE3& cam_from_world, const LocationPrior& prior) const;
  CoarsePose OptimiseOn(const Frame& frame, const LocalMap& local_map, const SeenList& seen,
                        const SE3& initial) const;

  const Camera camera_;
  const LocatorOptions options_;
  Matcher* matcher_;
  StageListener* stages_;
};

/// The landmarks that a keyframe's key points show, for matches (a: frame, b: keyframe) with it.
std::vector<LocatedFrame::Seen> LandmarksOf(const std::vector<Match>& matches,
                                            const LocalKeyframe& keyframe);

/// The same of what is seen of a local map, by the ids of the map's landmarks.
std::vector<LandmarkMatch> MatchesOf(const std::vector<LocatedFrame::Seen>& seen,
                                     const LocalMap& local_map);

}  // namespace deepuav
