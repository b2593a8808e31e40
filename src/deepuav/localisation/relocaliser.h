#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/localisation/frame_locator.h"

namespace deepuav {

struct RelocaliserOptions {
  int neighbours = 2;            ///< Of a candidate's keyframe that are matched as well.
  int thorough_candidates = 2;   ///< Matched again by the thorough matcher where no pose is sure.
  int min_matches = 15;          ///< Landmarks matched without a pose; fewer: not looked at closer.
  double search_radius_px = 15;  ///< Search window around a landmark's pixel by the first pose.
  int min_inliers = 30;          ///< Landmarks that agree with the pose at the end.
  double min_inlier_ratio = 0.05;  ///< Of the landmarks expected in the view.
  int cells_per_side = 8;          ///< Of the grid over the image that inliers are spread on.
  int min_cells = 12;              ///< With an inlier, so that no small repeated object counts.
  double rival_ratio = 0.6;     ///< Inliers of another place over the best's that make it a rival.
  double rival_distance = 0.2;  ///< Over the mean distance of landmarks: another place.
  double rival_angle_deg = 10;  ///< Likewise.
  AbsolutePoseOptions absolute_pose{.max_iterations = 2000};  ///< Of matches found without a pose.

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("neighbours", neighbours, "", "neighbours of a candidate that are matched as well",
          Between(0, 1000));
    visit("thorough_candidates", thorough_candidates, "",
          "candidates that a learned matcher is asked for where nearest neighbours give no sure "
          "pose",
          Between(0, 1000));
    visit("min_matches", min_matches, "", "landmarks matched without a pose, at least",
          Between(4, 100'000));
    visit("search_radius_px", search_radius_px, "px",
          "search window around a landmark's pixel by the first pose", Above(0, 10'000));
    visit("min_inliers", min_inliers, "", "landmarks that agree with the pose, at least",
          Between(6, 100'000));
    visit("min_inlier_ratio", min_inlier_ratio, "",
          "landmarks that agree over those expected in the view, at least", Below(0, 1));
    visit("cells_per_side", cells_per_side, "", "of the grid that inliers are spread on",
          Between(1, 1000));
    visit("min_cells", min_cells, "", "cells of the grid with an inlier, at least",
          Between(1, 1'000'000));
    visit("rival_ratio", rival_ratio, "",
          "inliers of a pose elsewhere over the best's from which neither counts", Above(0, 1));
    visit("rival_distance", rival_distance, "",
          "between poses that contradict each other, over the mean distance of landmarks",
          Above(0, 1e6));
    visit("rival_angle_deg", rival_angle_deg, "deg", "between poses that contradict each other",
          Above(0, 180));
    visit.Part("absolute_pose", absolute_pose);
  }
};

/// What speaks for a pose found without a prediction.
struct LocationEvidence {
  int matches = 0;   ///< Landmarks matched without a pose.
  int agreeing = 0;  ///< Of these, with the first pose.
  int inliers = 0;   ///< Landmarks agreeing with the pose at the end.
  int visible = 0;   ///< Landmarks expected in the view.
  int cells = 0;     ///< With an inlier.

  double InlierRatio() const { return visible > 0 ? double(inliers) / visible : 0; }
};

/// What matches a frame with keyframes of places where it may be.
struct PlaceMatchers {
  Matcher* quick = nullptr;     ///< Of all candidates.
  Matcher* thorough = nullptr;  ///< Of the best, where no pose is sure; null: none.
};

/// Finds a frame in maps without knowing where it is. A wrong pose is worse than none: one counts
/// only if enough landmarks agree, they are a good share of those that the frame should see and lie
/// all over its image, and no other place explains the frame nearly as well. Thread-compatible.
class Relocaliser {
 public:
  struct Found {
    int candidate = 0;      ///< Index into the candidates.
    int quarter_turns = 0;  ///< Clockwise, of the descriptors that the pose was found with.
    LocatedFrame located;
    LocationEvidence evidence;
  };

  /// The pointers must outlive it; `stages` may be null. `locator` is used but for its robust pose.
  Relocaliser(const Camera& camera, const RelocaliserOptions& options,
              const LocatorOptions& locator, PlaceMatchers matchers, StageListener* stages);

  /// `candidates`: the surroundings of keyframes (LocalMap::centre) that look like the frame.
  /// `turned`: the frame's descriptors on the image turned clockwise by 90, 180 and 270 degrees
  /// (those not described empty), or none. `headings`: under which of these each candidate
  /// resembles the frame (0: upright); it is tried under that one and upright then, else, without
  /// `headings`, under all. Nothing when no pose is sure; `reason` (if given) then says why. Throws
  /// Error for another number of turned descriptors.
  std::optional<Found> Relocalise(const Frame& frame, std::span<const Descriptors> turned,
                                  std::span<const std::shared_ptr<const LocalMap>> candidates,
                                  std::string* reason = nullptr,
                                  std::span<const int> headings = {});

  /// Whether this is enough for a pose to count.
  bool IsSure(const LocationEvidence& evidence) const;

 private:
  /// The frame as it looks with its image turned.
  struct View {
    int quarter_turns = 0;
    Frame frame;
  };
  /// A view matched without a pose, and the pose that came of it, if any.
  struct Trial {
    const View* view = nullptr;
    std::vector<LocatedFrame::Seen> matches;
    std::optional<CoarsePose> pose;

    size_t Agreeing() const { return pose ? pose->seen.size() : 0; }
  };

  /// Upright, and under those of the turned descriptors that `headings` name, or under all.
  std::vector<View> ViewsOf(const Frame& frame, std::span<const Descriptors> turned,
                            std::span<const int> headings) const;
  /// A sure pose comes before any other, then the one with more inliers.
  std::pair<bool, int> RankOf(const Found& found) const;
  std::pair<bool, int> RankOf(const std::optional<Found>& found) const;
  /// Asks the thorough matcher for the candidates with most inliers, then for the first ones, and
  /// keeps what is better than in `found`, a pose or none of each candidate. Where that gives a
  /// sure pose the others are asked for as well: they may explain the frame, too.
  void LocateThoroughly(const std::vector<View>& views, const KeypointGrid& grid,
                        std::span<const std::shared_ptr<const LocalMap>> candidates,
                        std::span<const int> headings, std::vector<std::optional<Found>>* found);
  /// Under `heading` and upright, or under all headings where there is none.
  std::optional<Found> LocateViews(const std::vector<View>& views, const KeypointGrid& grid,
                                   const LocalMap& candidate, std::optional<int> heading,
                                   Matcher* matcher);
  Trial MatchCentre(const View& view, const LocalMap& candidate, Matcher* matcher);
  void MatchNeighbours(const LocalMap& candidate, Matcher* matcher, Trial* trial);
  int CellCount(const Frame& frame, const LocatedFrame& located) const;
  bool Contradict(const Found& a, const Found& b,
                  std::span<const std::shared_ptr<const LocalMap>> candidates) const;

  const Camera camera_;
  const RelocaliserOptions options_;
  const double local_radius_px_;
  const FrameLocator locator_;
  const PlaceMatchers matchers_;
  StageListener* stages_;
};

}  // namespace deepuav
