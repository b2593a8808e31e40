#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>

#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"
#include "deepuav/survey/tracks/tracks.h"

namespace deepuav {

/// By how much larger errors are taken to be than they are once enough photographs tell the lens; 1
/// from then on, and for a lens that is not refined.
double LensDoubt(const SurveyState& state);

/// The points of a survey's tracks by the poses that are known: where most sights agree, and which
/// of them do. Keeps nothing of the states it works on, which must be of its tracks.
class TrackPoints {
 public:
  /// The pointers must outlive it.
  TrackPoints(const Tracks* tracks, const ViewPixels* px, const SurveyOptions& options);

  /// Of the tracks that a view shows, judges those that have a point and triangulates the others.
  void TriangulateIn(int view, SurveyState* state) const;
  /// Triangulates the tracks without a point. Gives how many points were found.
  int TriangulateAll(SurveyState* state) const;
  /// Says anew which sights agree with their points, and takes those points away with which fewer
  /// than two do, or two without parallax. Gives how many sights changed sides.
  int Judge(SurveyState* state) const;

  /// How far a sight that agrees may lie from its point; pixels, of a key point detected at the
  /// photograph's own size.
  double MaxErrorPx(const SurveyState& state) const;
  const Eigen::Vector2d& PixelOf(const Track::Sight& sight) const;

 private:
  const SightPixel& SightOf(const Track::Sight& sight) const;
  double MaxSquaredErrorPx(const SightPixel& sight, const SurveyState& state) const;
  bool Agrees(const Eigen::Vector3d& point, const Track::Sight& sight,
              const SurveyState& state) const;
  bool Triangulate(size_t track, SurveyState* state) const;
  std::optional<Eigen::Vector3d> PointOf(std::span<const Track::Sight* const> sights,
                                         const SurveyState& state) const;
  int JudgeTrack(size_t track, SurveyState* state) const;
  int ForAllTracks(const std::function<int(size_t)>& count) const;

  const Tracks* tracks_;
  const ViewPixels* px_;
  SurveyOptions options_;
};

}  // namespace deepuav
