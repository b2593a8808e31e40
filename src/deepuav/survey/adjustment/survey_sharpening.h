#pragma once

#include <functional>
#include <vector>

#include "deepuav/base/stages.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/survey/adjustment/survey_adjustment.h"
#include "deepuav/survey/growth/survey_growth.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"
#include "deepuav/survey/tracks/track_measurement.h"

namespace deepuav {

/// How points are measured once the map stands.
struct SurveyMeasuring {
  PatchOptions patches;
  ModelNoiseOptions model_noise;
  SurfaceNormalOptions surface;
};

/// The camera with the lens that the photographs tell.
Camera WithLens(Camera camera, const SurveyLens& lens);

/// Measures the points of a map by patches and adjusts all by what these say, with as much of the
/// lens as they tell. Thread-compatible.
class SurveySharpening {
 public:
  /// `views` must outlive it; `stages` may be null. `keeps_distortion`: the survey's pixels are
  /// those of the images as taken.
  SurveySharpening(const std::vector<SurveyView>* views, const Camera& camera,
                   bool keeps_distortion, const SurveyOptions& options,
                   const SurveyMeasuring& measuring, StageListener* stages);

  /// Takes a lens that folds over inside the image out of the map.
  void KeepLensOneToOne(const std::function<bool()>& stop, BuiltSurvey* built) const;
  void Sharpen(const std::function<bool()>& stop, BuiltSurvey* built) const;

 private:
  void Measure(BuiltSurvey* built) const;
  void Readjust(double max_sigmas, const std::function<void(SurveyGrowth*)>& by,
                BuiltSurvey* built) const;
  void AdjustMeasured(const std::function<bool()>& stop, BuiltSurvey* built) const;
  bool RefineWholly(const std::function<bool()>& stop, BuiltSurvey* built) const;

  const std::vector<SurveyView>* views_;
  const Camera camera_;
  const bool keeps_distortion_;
  const SurveyOptions options_;
  const SurveyMeasuring measuring_;
  StageListener* stages_;
};

}  // namespace deepuav
