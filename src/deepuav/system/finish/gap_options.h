#pragma once

#include "deepuav/base/option_bounds.h"

namespace deepuav {

struct GapOptions {
  bool enabled = true;
  double max_gap_s = 20;        ///< Between two located frames, at most.
  double max_unseen_s = 0.5;    ///< Without images that tell how the camera turned, at most.
  double max_rim_s = 1;         ///< On either side, of frames that see few landmarks.
  int firm_landmarks = 100;     ///< Landmarks that a pose rests on; with fewer it may move.
  double motion_window_s = 3;   ///< Before and after, from which follows how the camera moves.
  int min_pairs = 15;           ///< That agree on how the camera turned between two frames...
  double min_pair_ratio = 0.5;  ///< ...over those matched, and in the end over those.
  double max_position_sigma =
      0.03;  ///< Of a pose: standard deviation of the position over the scene's distance.
  double max_turn_sigma_deg = 1;  ///< Of a pose, likewise.
  double max_misfit = 2;  ///< Root mean square of motion against its noise: more contradicts it.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "",
          "at the end, give lost frames between two located ones the most probable pose");
    visit("max_gap_s", max_gap_s, "s", "between the located frames, at most", Between(0, 60));
    visit("max_unseen_s", max_unseen_s, "s",
          "without images that tell how the camera turned, at most", Between(0, 60));
    visit("max_rim_s", max_rim_s, "s",
          "before and after, of frames that see few landmarks and are placed anew with them",
          Between(0, 60));
    visit("firm_landmarks", firm_landmarks, "", "landmarks below which a frame sees few",
          Between(0, 100000));
    visit("motion_window_s", motion_window_s, "s",
          "before and after, from which follows how unsteadily the camera moves", Above(0, 1e6));
    visit("min_pairs", min_pairs, "",
          "matches that agree on how the camera turned between two frames, at least",
          Between(3, 100000));
    visit("min_pair_ratio", min_pair_ratio, "",
          "of these over all matches, and that still do in the end over these, at least",
          Between(0, 1));
    visit("max_position_sigma", max_position_sigma, "",
          "standard deviation of a position over the scene's distance; more: it stays lost",
          Above(0, 1e6));
    visit("max_turn_sigma_deg", max_turn_sigma_deg, "deg",
          "standard deviation of an orientation; more: it stays lost", Above(0, 180));
    visit("max_misfit", max_misfit, "",
          "motion over what its noise allows (root mean square), above which all stays lost",
          Above(0, 1e6));
  }
};

}  // namespace deepuav
