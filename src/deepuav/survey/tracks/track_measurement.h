#pragma once

#include <vector>

#include "deepuav/estimation/bundle/model_noise.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/patches/patch_alignment.h"
#include "deepuav/patches/surface_normals.h"
#include "deepuav/survey/pairs/view_pairs.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// What the patches of a survey are aligned in: images as taken, of views whose frames have them,
/// through the lens as far as it is known.
struct PatchSurvey {
  const std::vector<SurveyView>* views = nullptr;
  Camera camera;
  bool keeps_distortion = false;  ///< Pixels are those of the images as taken, not undistorted.
  PatchOptions options;
  SurfaceNormalOptions surface;
  int threads = 1;  ///< That find surfaces; they change nothing in the result.
};

/// Measures each point's sights by aligning patches: of those that agree, the one from the middle
/// of the directions from which they see the point is the reference, and its key point the patch's
/// middle by definition, on the surface as that view shows it. Sights whose patches do not tell
/// stay as they were detected. Returns how many were measured.
int MeasureTracks(const PatchSurvey& survey, const Tracks& tracks, const SurveyState& state,
                  ViewPixels* px);

/// How fast each view with a pose moves, from its neighbours in time; zero across gaps.
std::vector<Eigen::Vector3d> ViewVelocities(const std::vector<SurveyView>& views,
                                            const SurveyState& state);

/// What the reprojection errors of measured sights show beyond their own noise (calibration,
/// shutter, surfaces that are no planes), px; what the state has where too few points tell.
double ModelSigmaPx(const Tracks& tracks, const ViewPixels& px, const SurveyState& state,
                    const ModelNoiseOptions& options);

}  // namespace deepuav
