#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// Adjusts the poses of `free` views and all points that these see, other views held; the lens with
/// them where `refine_lens`. The first view of the state holds the gauge.
void AdjustViews(const Tracks& tracks, const ViewPixels& px, const std::vector<int>& free,
                 bool refine_lens, int max_iterations, const SurveyOptions& options,
                 const std::function<bool()>& stop, SurveyState* state);

/// The same for all views.
void AdjustAllViews(const Tracks& tracks, const ViewPixels& px, bool refine_lens,
                    int max_iterations, const SurveyOptions& options,
                    const std::function<bool()>& stop, SurveyState* state);

/// What the views tell of a lens that is refined, besides its camera.
struct RefinedLens {
  CalibrationSigmas sigmas;
  double readout_s = 0;  ///< Of a rolling shutter; 0: not told.
};

/// How well the lens is known now; nothing where it is not refined.
std::optional<RefinedLens> DescribeLens(const Tracks& tracks, const ViewPixels& px,
                                        const SurveyOptions& options, const SurveyState& state);

}  // namespace deepuav
