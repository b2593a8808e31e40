#pragma once

#include <Eigen/Core>
#include <optional>
#include <set>
#include <vector>

#include "deepuav/geometry/sim3.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// What one map of the same tracks says of another.
struct MapLink {
  Sim3 main_from_side;
  /// Of points of the one in photographs of the other, that a photograph outside shows, too; but
  /// for those in a photograph that alone both have, which agree at any scale.
  int sights = 0;
  int agreeing = 0;        ///< Of these, within `max_error_px`.
  double scale_sigma = 0;  ///< As a share of the scale, by the sights that agree.
};

/// The similarity under which most sights of points of `side` in photographs of `main` alone, and
/// of `main` in `outside`, those of `side` alone, agree. Neither map need have a point of the
/// other: photographs that both have a pose of say how they are turned and where they meet, a sight
/// in another photograph the scale, and all sights the rest. Nothing where both have none in
/// common.
std::optional<MapLink> FindMapLink(const Tracks& tracks, const ViewPixels& px,
                                   const SurveyState& main, const SurveyState& side,
                                   const std::set<int>& outside, double max_error_px);

}  // namespace deepuav
