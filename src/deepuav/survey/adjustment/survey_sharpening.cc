#include "deepuav/survey/adjustment/survey_sharpening.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/logging.h"
#include "deepuav/survey/growth/survey_growth.h"

namespace deepuav {

Camera WithLens(Camera camera, const SurveyLens& lens) {
  camera.pinhole = lens.camera.pinhole;
  if (lens.camera.IsUndistorted()) return camera;
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {lens.camera.k1, lens.camera.k2, lens.camera.p1, lens.camera.p2};
  return camera;
}

SurveySharpening::SurveySharpening(const std::vector<SurveyView>* views, const Camera& camera,
                                   bool keeps_distortion, const SurveyOptions& options,
                                   const SurveyMeasuring& measuring, StageListener* stages)
    : views_(views),
      camera_(camera),
      keeps_distortion_(keeps_distortion),
      options_(options),
      measuring_(measuring),
      stages_(stages) {}

void SurveySharpening::Sharpen(const std::function<bool()>& stop, BuiltSurvey* built) const {
  SurveyState& state = built->state;
  Measure(built);
  state.image_rows = camera_.height;
  const bool is_measured = state.model_sigma_px > 0;
  for (int round = 1; is_measured && round < options_.patch_rounds; ++round) {
    {
      const StageScope stage(stages_, "sharpen map");
      Readjust(
          options_.max_unsettled_sigmas, [&](SurveyGrowth* growth) { growth->Settle(stop); },
          built);
    }
    Measure(built);
  }
  const StageScope stage(stages_, "sharpen map");
  if (is_measured && state.lens.is_refined && RefineWholly(stop, built)) return;
  AdjustMeasured(stop, built);
}

void SurveySharpening::Measure(BuiltSurvey* built) const {
  const StageScope stage(stages_, "align patches");
  PatchSurvey survey{views_,
                     WithLens(camera_, built->state.lens),
                     keeps_distortion_,
                     measuring_.patches,
                     measuring_.surface,
                     ThreadsOf(options_)};
  survey.options.noise_factor = options_.patch_noise_factor;
  survey.options.min_sigma_px = options_.patch_min_sigma_px;
  const int measured = MeasureTracks(survey, built->tracks, built->state, &built->px);
  Log().debug("{} sights were measured by patches", measured);
  if (measured > 0 && built->state.model_sigma_px == 0)
    built->state.model_sigma_px = measuring_.model_noise.initial_sigma_px;
}

/// Goes on from the points as they are measured, and learns what is left beyond their noise.
void SurveySharpening::Readjust(double max_sigmas, const std::function<void(SurveyGrowth*)>& by,
                                BuiltSurvey* built) const {
  SurveyState& state = built->state;
  if (state.lens.is_refined_wholly) state.velocity_world = ViewVelocities(*views_, state);
  SurveyOptions options = options_;
  options.max_patch_sigmas = max_sigmas;
  SurveyGrowth growth(&built->tracks, &built->px, state.lens, options);
  growth.Continue(state);
  by(&growth);
  state = growth.state();
  state.model_sigma_px = ModelSigmaPx(built->tracks, built->px, state, measuring_.model_noise);
  Log().debug("patches err by {:.3f} px beyond their own noise; readout {:.4f} s",
              state.model_sigma_px, state.lens.camera.readout_s);
}

/// Weights and what is adjusted by them depend on one another.
void SurveySharpening::AdjustMeasured(const std::function<bool()>& stop, BuiltSurvey* built) const {
  constexpr int kMostRounds = 2;
  constexpr double kSameWeights = 0.25;  // Change of the model's errors that hardly moves the map.
  for (int round = 0; round < kMostRounds; ++round) {
    const double assumed_px = built->state.model_sigma_px;
    Readjust(
        options_.max_unsettled_sigmas, [&](SurveyGrowth* growth) { growth->Settle(stop); }, built);
    if (std::abs(built->state.model_sigma_px - assumed_px) <= kSameWeights * assumed_px) break;
  }
  Readjust(
      options_.max_patch_sigmas, [&](SurveyGrowth* growth) { growth->Finish(stop); }, built);
}

/// A lens of which a rest stays unexplained bends otherwise: more parameters would take on what
/// they don't mean. Few views, or views under one heading, explain all and tell nothing. False, and
/// all as before, where it is so.
bool SurveySharpening::RefineWholly(const std::function<bool()>& stop, BuiltSurvey* built) const {
  BuiltSurvey whole = *built;
  whole.state.lens.is_refined_wholly = true;
  AdjustMeasured(stop, &whole);
  if (whole.state.model_sigma_px > options_.max_model_sigma_px) return false;
  const auto lens = DescribeLens(whole.tracks, whole.px, options_, whole.state);
  if (lens) {
    Log().debug("all of the lens: focal length to {:.2f} %, centre to {:.2f} %",
                100 * lens->sigmas.focal, 100 * lens->sigmas.centre);
  }
  const double limit = options_.max_whole_lens_sigma;
  if (!lens || lens->sigmas.focal > limit || lens->sigmas.centre > limit) return false;
  *built = std::move(whole);
  KeepLensOneToOne(stop, built);
  return true;
}

/// Where few photographs tell the lens's bend at their corners, it may fold over there.
void SurveySharpening::KeepLensOneToOne(const std::function<bool()>& stop,
                                        BuiltSurvey* built) const {
  SurveyLens& lens = built->state.lens;
  const double corner_px =
      std::hypot(std::max(lens.camera.pinhole.cx, camera_.width - 1 - lens.camera.pinhole.cx),
                 std::max(lens.camera.pinhole.cy, camera_.height - 1 - lens.camera.pinhole.cy));
  if (!lens.is_refined || lens.IsOneToOne(corner_px)) return;
  Log().warn(
      "the radial distortion found (k1 {:.3f}, k2 {:.3f}) folds over inside the image: none "
      "is used",
      lens.camera.k1, lens.camera.k2);
  lens.camera.k1 = lens.camera.k2 = lens.camera.p1 = lens.camera.p2 = 0;
  lens.is_refined = false;
  SurveyOptions unsettled = options_;
  unsettled.max_patch_sigmas = options_.max_unsettled_sigmas;
  SurveyGrowth growth(&built->tracks, &built->px, lens, unsettled);
  growth.Resume(built->state);
  growth.Settle(stop);
  growth.Finish(stop);
  built->state = growth.state();
}

}  // namespace deepuav
