#pragma once

#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "deepuav/survey/adjustment/survey_adjustment.h"
#include "deepuav/survey/pairs/view_pairs.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"
#include "deepuav/survey/tracks/track_points.h"

namespace deepuav {

/// Makes a map of photographs grow, one after the other, from a pair of them (incremental structure
/// from motion; Schönberger and Frahm, CVPR 2016). The lens is refined with it where it is a guess.
/// A value: a start that leads nowhere is dropped. Thread-compatible.
class SurveyGrowth {
 public:
  /// The pointers must outlive it.
  SurveyGrowth(const Tracks* tracks, const ViewPixels* px, const SurveyLens& lens,
               const SurveyOptions& options);

  /// From now on `watch` is told of what is known whenever a photograph was added.
  void Watch(std::function<void(const SurveyState&)> watch) { watch_ = std::move(watch); }

  /// The poses that the pair may have, by falling support; none without parallax.
  std::vector<SE3> PosesOf(const MatchedPair& pair) const;

  /// Starts with the pair and one of its poses. False where hardly a point comes of it.
  bool Start(const MatchedPair& pair, const SE3& b_from_a);

  /// Goes on from poses that are known, with other tracks.
  void Resume(const SurveyState& known);

  /// Goes on from a state of the same tracks, which may be measured anew.
  void Continue(const SurveyState& known);

  /// Adds the photographs that see most of the map, until it has `most_views` or none fits. Those
  /// in `taken` belong to other maps.
  void Grow(int most_views, const std::set<int>& taken, const std::function<bool()>& stop);

  /// Adjusts all, completes the points and discards what does not agree, until hardly a sight
  /// changes any more. Poses and lens are then right to their standard deviations.
  void Settle(const std::function<bool()>& stop);

  /// Adjusts all once more, to the end.
  void Finish(const std::function<bool()>& stop);

  /// How well the map explains what its photographs see: observations, each by how far within the
  /// bound it reprojects.
  double Support() const;

  const SurveyState& state() const { return state_; }

 private:
  struct NextView {
    int view = -1;
    int points = 0;
  };

  NextView ChooseNext(const std::set<int>& taken) const;
  bool AddView(int view);
  void AdjustAround(int view, const std::function<bool()>& stop);
  int AdjustAll(int max_iterations, double max_last_move, const std::function<bool()>& stop);

  const Tracks* tracks_;
  const ViewPixels* px_;
  SurveyOptions options_;
  TrackPoints points_;
  SurveyState state_;
  std::function<void(const SurveyState&)> watch_;
  std::vector<int> failed_at_;  ///< By view: the points it matched when no pose was found.
  int adjusted_views_ = 0;      ///< Of the map when all of it was last adjusted.
};

}  // namespace deepuav
