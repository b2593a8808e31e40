#pragma once

#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/poses/absolute_pose.h"
#include "deepuav/estimation/two_views/three_view.h"
#include "deepuav/estimation/two_views/two_view.h"
#include "deepuav/map/requests.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/patches/patch_alignment.h"
#include "deepuav/tracking/start_confirmation.h"

namespace deepuav {

struct InitialiserOptions {
  int min_keypoints = 100;  ///< A frame with fewer starts nothing.
  int min_matches = 60;     ///< Of a second view to a first.
  int max_first_views = 5;  ///< That wait for a second: one may be blurred, or soon out of sight.
  int max_pairs = 5;        ///< Of a first and a second view, that wait for a third.
  /// A frame is one, too, that the newest of them has less than this share of those matches in
  /// common with that it had with the best: what is near goes out of sight before the far away that
  /// is still matched shows any parallax.
  double min_first_share = 0.8;
  int max_unmatched_frames = 10;   ///< In a row, with too few matches or too few that agree.
  int max_first_age_frames = 120;  ///< An older first view without a second is dropped.
  /// A pair that no later frame confirmed by then, or by as many frames as lie between its views if
  /// that is more, is given up: a slow camera needs as long again. See also max_refutations.
  int max_second_age_frames = 10;
  double min_confirmed_ratio =
      0.7;  ///< Of the points matched in the third view, those that reproject well.
  int min_confirmed = 40;
  /// Views that match as many points and confirm a smaller share of them. One may be blurred; the
  /// pair is given up with this many.
  int max_refutations = 2;
  double min_lead = 1.15;  ///< Mean squared error of the second best solution over the best's.
  double third_parallax_ratio =
      0.3;  ///< The third view's baseline to the second, over that of the first two.
  double turn_sigma_rad_s = 0.5;  ///< Of how a camera with a rolling shutter turns while it reads
                                  ///< an image, where no gyroscope tells, at least.
  /// That turn, over the rate at which the picture moves from one frame to the other: a camera that
  /// shakes faster than its images come turns more quickly than they show.
  double turn_sigma_of_rate = 5;
  /// A drone that looks ahead sees most things too far away for any parallax: points whose distance
  /// is known decide, not the median.
  TwoViewOptions two_view{.min_parallax_deg = 0,
                          .min_certain = 60,
                          .min_valid_ratio = 0.6,
                          .min_undisputed_ratio = 0.9,
                          .min_moved_ratio = 0.7};
  AbsolutePoseOptions absolute_pose;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_keypoints", min_keypoints, "", "key points of a first view", Between(8, 100'000));
    visit("min_matches", min_matches, "", "matches of a second view to a first",
          Between(8, 100'000));
    visit("max_first_views", max_first_views, "", "first views that wait for a second at a time",
          Between(1, 100));
    visit("min_first_share", min_first_share, "",
          "matches of a frame with the newest first view, over the most that this had with one, "
          "below which the frame becomes one, too",
          Between(0, 1));
    visit("max_pairs", max_pairs, "", "first and second views that wait for a third at a time",
          Between(1, 100));
    visit("max_unmatched_frames", max_unmatched_frames, "",
          "frames in a row with too few matches, or too few that agree, that a first view outlasts",
          Between(0, 1'000'000));
    visit("max_first_age_frames", max_first_age_frames, "",
          "frames after which a first view that has no second is dropped", Between(2, 1'000'000));
    visit("max_second_age_frames", max_second_age_frames, "",
          "frames within which a third view must confirm, or as many as lie between the first two",
          Between(1, 1'000'000));
    visit("min_confirmed_ratio", min_confirmed_ratio, "",
          "share of the matched points that the third view confirms", Above(0, 1));
    visit("min_confirmed", min_confirmed, "", "points that the third view confirms at least",
          Between(6, 100'000));
    visit("max_refutations", max_refutations, "", "views that refute a pair before it is given up",
          Between(1, 1'000'000));
    visit("min_lead", min_lead, "",
          "mean squared error of the second best solution in three views over that of the best",
          Between(1, 100));
    visit("third_parallax_ratio", third_parallax_ratio, "",
          "least baseline of the third view over that of the first two", Between(0, 100));
    visit("turn_sigma_rad_s", turn_sigma_rad_s, "rad/s",
          "standard deviation of how a camera with a rolling shutter turns while it reads an "
          "image, where no gyroscope tells, at least",
          Between(0, 100));
    visit("turn_sigma_of_rate", turn_sigma_of_rate, "",
          "that standard deviation over the rate at which the picture moves between two frames",
          Between(0, 1000));
    visit.Part("two_view", two_view);
    visit.Part("absolute_pose", absolute_pose);
  }
};

/// Finds the first two views of a map, and a third that confirms them: a plane seen by two has two
/// explanations, and a wrong start is worse than a late one. Thread-compatible.
class Initialiser {
 public:
  /// `matcher` must outlive it.
  Initialiser(const Camera& camera, const InitialiserOptions& options, const PatchOptions& patches,
              Matcher* matcher);

  void Reset();

  /// Takes the next frame; gives the two views once a third has confirmed them. Otherwise
  /// `waiting_for` says what is missing.
  std::optional<InitialMapRequest> Add(const Frame& frame, std::string* waiting_for);

 private:
  /// Seen together with a first view: a third has to confirm what the two show.
  struct SecondView {
    Frame frame;
    std::vector<Match> matches;    ///< first -> second
    std::vector<PixelPair> pairs;  ///< Where these are.
    TwoViewResult result;
    int refutations = 0;
    int unseen_frames = 0;  ///< The last ones, in a row, that show too little of the matches.
  };

  struct FirstView {
    Frame frame;
    int unmatched_frames = 0;  ///< The last ones, in a row, of which too few matches agree.
    int matched = 0, most_matched = 0;  ///< Key points, with the last frame and with the best.
    std::optional<SecondView> second = std::nullopt;
  };

  /// What the views that are held say of a frame.
  struct Recognised {
    bool by_pair = false;     ///< It shows points of one.
    bool by_first = false;    ///< It matches one that still waits for a second view...
    double newest_share = 0;  ///< ...the newest of which with so many over its most matches.
  };

  void ForgetOldViews(FrameId now);
  std::optional<InitialMapRequest> Confirm(const Frame& third, Recognised* recognised);
  std::optional<InitialMapRequest> ConfirmPair(FirstView* first, const Frame& third);
  /// Where these are.
  std::vector<PixelPair> PairsOf(const Frame& a, const Frame& b,
                                 const std::vector<Match>& matches) const;
  /// The matches of a pair that go on into the third view.
  std::vector<SeenThrice> FollowInto(const Frame& third, const FirstView& first) const;
  bool Confirms(const Confirmation& found) const;
  void Propose(const Frame& second, Recognised* recognised, std::string* waiting_for);
  void ProposeFrom(FirstView* first, const Frame& second, std::string* waiting_for);
  void LimitPairs();
  void AddFirstView(const Frame& frame, bool goes_on);
  static InitialMapRequest MakeRequest(const FirstView& first, const TwoViewSolution& solution);

  const Camera camera_;
  const InitialiserOptions options_;
  const PatchOptions patches_;
  Matcher* matcher_;
  std::vector<FirstView> firsts_;  ///< From the oldest on.
};

}  // namespace deepuav
