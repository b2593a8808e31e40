#include "deepuav/assembly/datasets/dataset_run.h"

#include <algorithm>
#include <exception>

#include "deepuav/base/logging.h"

namespace deepuav {

bool DatasetRun::PassAgain(const Camera& told, const RunHooks& hooks, Pass* pass) {
  const bool was_in_doubt = pass->result.focal_doubt.has_value();
  std::optional<Camera> by_sample = FollowDoubt(hooks, pass);
  if (!WasSpoilt(pass->result)) return by_sample.has_value();
  const Camera& began_with = by_sample ? *by_sample : told;
  told_pinhole_ = began_with.pinhole;
  const std::map<Timestamp, ReadoutMotion> known = pass->result.image_turns;
  // The map may have begun where the first one had lost its images, and a lens that was far off is
  // found by halves.
  if (PassAnew(began_with, hooks, pass) &&
      (TellsMoreTurns(known, pass->result) || WasLensOff(pass->result)))
    PassAnew(began_with, hooks, pass);
  // What else was wrong may have hidden it.
  if (!was_in_doubt) by_sample = FollowDoubt(hooks, pass);
  return by_sample.has_value();
}

bool DatasetRun::WasSpoilt(const SlamResult& result) const {
  if (result.ended_early()) return false;
  return HidReadout(result) || HidWriting(result) || WasLensOff(result) ||
         result.image_turns_saved_share >= options_.system.image_turns.begin_anew_share;
}

bool DatasetRun::HidReadout(const SlamResult& result) const {
  return result.readout &&
         result.readout->cost_share >= options_.system.mapping.readout.begin_anew_share;
}

bool DatasetRun::HidWriting(const SlamResult& result) const {
  return !result.image_fixed.empty() &&
         result.image_fixed_keypoint_share >= options_.system.image_fixed.begin_anew_share;
}

bool DatasetRun::WasBent(const SlamResult& result) const {
  return HidReadout(result) || HidWriting(result) || !result.image_turns.empty();
}

bool DatasetRun::WasLensOff(const SlamResult& result) const {
  if (result.ended_early()) return false;
  const LensSearchOptions& search = options_.system.mapping.lens;
  return (search.whole || !WasBent(result)) && result.lens_shift_px >= search.begin_anew_px;
}

bool DatasetRun::TellsMoreTurns(const std::map<Timestamp, ReadoutMotion>& known,
                                const SlamResult& result) const {
  if (known.empty() || result.ended_early()) return false;
  const auto is_new = [&](const auto& turn) { return !known.contains(turn.first); };
  const auto more = std::ranges::count_if(result.image_turns, is_new);
  return static_cast<double>(more) >=
         options_.system.image_turns.begin_again_share * images_.count();
}

std::optional<Camera> DatasetRun::FollowDoubt(const RunHooks& hooks, Pass* doubted) {
  SlamResult& result = doubted->result;
  if (!result.focal_doubt || result.ended_early()) return std::nullopt;
  std::optional<Camera> followed;
  try {
    const auto sample = ConfirmBySample(result.focal_doubt->ratio, dataset_.get(), request_.range,
                                        options_, hooks.stop);
    if (sample && PassBySample(*sample, hooks, doubted)) followed = sample->camera;
  } catch (const std::exception& error) {
    // What the first pass has is not to be lost.
    Log().warn("{}: the focal length stays as it was told", error.what());
  }
  if (hooks.stop && hooks.stop()) result.stopped = true;
  return followed;
}

void DatasetRun::SurveyAgain(const Camera& told, const SurveyHooks& hooks, SurveyRun* doubted) {
  SlamResult& result = doubted->result;
  if (!result.focal_doubt || result.ended_early()) return;
  Log().info("the photographs are made a map once more, as if their lens were not known");
  const Camera camera = OfUnknownLens(told);
  try {
    images_.Rewind();
    if (hooks.observer) hooks.observer->OnRestart();
    Eyes eyes(camera, options_.OfPhotographs());
    eyes.ProvideLearnedMatcher(camera, options_);
    SurveyRun anew = RunSurvey(camera, kDoubtedFocalSigma, options_.system, eyes.perception(),
                               &images_, hooks, sensors_.streams);
    result.stopped = anew.result.stopped;
    const auto& lens = anew.outcome.lens;
    if (anew.result.ended_early()) return;
    if (!lens || !lens->is_focal_told) {
      Log().warn("the images do not tell the lens: it stays as it was");
      return;
    }
    const double found_px = anew.outcome.camera.pinhole.fx;
    if (!Confirms(found_px, told.pinhole.fx, result.focal_doubt->ratio)) return;
    anew.result.focal_doubt = {found_px / told.pinhole.fx, lens->sigmas.focal};
    *doubted = std::move(anew);
  } catch (const std::exception& error) {
    Log().warn("{}: the focal length stays as it was told", error.what());
  }
}

bool DatasetRun::PassBySample(const SampleCalibration& sample, const RunHooks& hooks,
                              Pass* doubted) {
  BeginAnew(hooks);
  SystemOptions mending = options_.system;
  MendLensAtEnd(sample.lens, &mending);
  // A readout that was told is not in doubt.
  if (dataset_->camera().readout_s > 0)
    mending.mapping.readout.refine_known = options_.system.mapping.readout.refine_known;
  told_pinhole_ = sample.camera.pinhole;
  Eyes eyes(sample.camera, options_);
  Pass pass =
      PassOver(sample.camera, mending, &eyes, std::nullopt, hooks, doubted->result.image_fixed);
  if (KeepsFirst(pass, doubted)) return false;
  options_.system = mending;
  lens_ = sample.lens;
  *doubted = std::move(pass);
  return true;
}

void DatasetRun::BeginAnew(const RunHooks& hooks) {
  Log().info("the map was spoilt before that was known: once more from the first image on");
  images_.Rewind();
  if (hooks.observer) hooks.observer->OnRestart();
  if (hooks.work) hooks.work("frames", 0, images_.count());
}

bool DatasetRun::KeepsFirst(const Pass& anew, Pass* first) {
  const bool has_map = !anew.atlas.Remaining().empty();
  if (!anew.result.ended_early() && has_map) return false;
  Log().warn("that {}: the results are those of the first time",
             has_map ? "ended early" : "found no map");
  first->result.stopped = anew.result.stopped;
  first->result.failure = anew.result.failure;
  return true;
}

bool DatasetRun::PassAnew(const Camera& camera, const RunHooks& hooks, Pass* spoilt) {
  BeginAnew(hooks);
  images_.KnowTurns(spoilt->result.image_turns, options_.system.image_turns.sigma_rad);
  SystemOptions knowing = options_.system;
  const bool tells_readout = spoilt->result.readout.has_value();
  knowing.mapping.readout.refine_known |= tells_readout;
  const bool was_lens_off = WasLensOff(spoilt->result);
  // A calibration found wrong is none to stay near.
  LensSearchOptions& search = knowing.mapping.lens;
  if (was_lens_off) search.min_cost_share = std::min(search.min_cost_share, search.min_later_share);
  const bool knows_lens = options_.system.mapping.lens.whole || was_lens_off ||
                          (tells_readout && spoilt->result.image_turns.empty());
  Camera known = knows_lens ? spoilt->camera : camera;
  known.readout_s = spoilt->camera.readout_s;
  Eyes eyes(known, options_);
  Pass pass = PassOver(known, knowing, &eyes, std::nullopt, hooks, spoilt->result.image_fixed);
  if (KeepsFirst(pass, spoilt)) return false;
  if (!pass.result.readout) pass.result.readout = spoilt->result.readout;
  if (!pass.result.lens && knows_lens) pass.result.lens = spoilt->result.lens;
  // What was known of turns need not have been measured once more.
  pass.result.image_turns.insert(spoilt->result.image_turns.begin(),
                                 spoilt->result.image_turns.end());
  *spoilt = std::move(pass);
  return true;
}

}  // namespace deepuav
