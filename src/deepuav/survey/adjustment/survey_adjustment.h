#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// How an adjustment is made.
struct AdjustmentEffort {
  int max_iterations = 0;
  bool refine_lens = false;
  bool is_nearly_right = false;  ///< What is adjusted: large steps are tried from the first on.
  /// Square of the standard deviations by which poses and lens may still move at the end.
  double max_last_move = 0;
};

/// Adjusts the poses of `free` views and all points that these see, other views held; the lens with
/// them where the effort says so. The first view of the state holds the gauge.
void AdjustViews(const Tracks& tracks, const ViewPixels& px, const std::vector<int>& free,
                 const AdjustmentEffort& effort, const SurveyOptions& options,
                 const std::function<bool()>& stop, SurveyState* state);

/// The same for all views.
void AdjustAllViews(const Tracks& tracks, const ViewPixels& px, const AdjustmentEffort& effort,
                    const SurveyOptions& options, const std::function<bool()>& stop,
                    SurveyState* state);

/// What the views tell of a lens that is refined, besides its camera.
struct RefinedLens {
  CalibrationSigmas sigmas;
  double readout_s = 0;       ///< Of a rolling shutter; 0: not told.
  bool is_focal_told = true;  ///< Else it is as it was given, and so is its standard deviation.
};

/// How well the lens is known now; nothing where it is not refined. A focal length that is held has
/// the standard deviation that it was given with; what the views don't tell beside it has 0.
std::optional<RefinedLens> DescribeLens(const Tracks& tracks, const ViewPixels& px,
                                        const SurveyOptions& options, const SurveyState& state);

}  // namespace deepuav
