#include "deepuav/assembly/datasets/dataset_run.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "deepuav/assembly/datasets/soft_sample.h"
#include "deepuav/assembly/settings/wrong_use.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/files/options_file.h"
#include "deepuav/io/geodata/map_origin.h"

namespace deepuav {
namespace {

/// For reports that are made from another working folder; of no path, none.
std::string AbsolutePath(const std::string& path) {
  return path.empty() ? "" : std::filesystem::absolute(path).lexically_normal().string();
}

std::unique_ptr<Dataset> Open(const DatasetRequest& request, DatasetOptions options) {
  CheckSensorList(request.use);
  options.camera_file = request.camera;
  return OpenDataset(request.dataset, options);
}

/// Photographs that found no place, by their names.
void NameUnplaced(const SlamResult& result, const Dataset& dataset) {
  std::vector<std::string> names;
  for (const FrameRecord& record : result.frames) {
    if (record.located()) continue;
    if (const auto frame = FrameAt(dataset, record.time))
      names.push_back(dataset.ImageName(*frame));
  }
  if (!names.empty())
    Log().warn("{} photographs are in no map: {}", names.size(), fmt::join(names, ", "));
}

}  // namespace

void CheckLocalising(const RunOptions& options, const std::string& map) {
  if (!options.system.localise_only) return;
  if (map.empty()) throw WrongUse("option system.localise_only: expected --map with it");
  if (!RecognisesPlaces(options))
    throw WrongUse(
        "option system.localise_only: expected places.vocabulary with it, by which the map is "
        "found");
}

DatasetRun::DatasetRun(DatasetRequest request, std::unique_ptr<RunSettings> settings)
    : request_(std::move(request)),
      settings_(std::move(settings)),
      options_(settings_->options),
      schedule_((CheckLocalising(options_, request_.map), ParseSchedule(request_.schedule))),
      dataset_(Open(request_, options_.images)),
      images_(dataset_.get(), request_.range),
      sensors_(ReadSensorsUsed(request_.use, *dataset_)) {
  if (dataset_->CalibrationIsApproximate())
    MendLensAtEnd(dataset_->Calibration().focal_sigma, &options_.system);
}

DatasetRun::~DatasetRun() = default;

bool DatasetRun::IsSurvey() const {
  const SurveyOptions& survey = options_.system.survey;
  return dataset_->Kind() == "photographs" && survey.enabled && request_.map.empty() &&
         schedule_ != Schedule::kLive && images_.count() <= survey.max_photographs;
}

FinishedRun DatasetRun::Run(const RunHooks& hooks) {
  std::optional<LoadedAtlas> loaded;
  if (!request_.map.empty())
    loaded = LoadMaps(request_.map, dataset_->camera(), dataset_->CalibrationIsApproximate());
  const bool is_survey = IsSurvey();
  LimitSeenPixels(loaded, hooks.stop);
  std::optional<SampleCalibration> sample;
  if (!loaded && !is_survey) sample = CalibrateFromSample(dataset_.get(), options_, hooks.stop);
  if (sample) {
    MendLensAtEnd(sample->lens, &options_.system);
    lens_ = sample->lens;
  }
  const Camera camera = loaded ? loaded->camera : sample ? sample->camera : dataset_->camera();
  // What is looked for in a survey's map is to be seen as that was.
  const bool sees_whole = is_survey || (loaded && dataset_->Kind() == "photographs");
  Eyes eyes(camera, sees_whole ? options_.OfPhotographs() : options_);
  if (is_survey) eyes.ProvideLearnedMatcher(camera, options_);
  if (loaded) CheckNetwork(request_.map, *loaded, eyes);

  FinishedRun run;
  run.facts = FactsBefore(eyes, loaded);
  run.facts.sensors = std::move(sensors_.facts);
  RunHooks timed = hooks;
  timed.progress = [&](FrameId frame, const std::string& state) {
    if (run.facts.start_up_s == 0) run.facts.start_up_s = since_start_.Seconds();
    if (hooks.progress) hooks.progress(frame, state);
  };
  const Stopwatch running;
  if (is_survey) {
    RunAsSurvey(camera, &eyes, timed, &run);
  } else {
    RunInOrder(camera, &eyes, std::move(loaded), timed, &run);
  }
  run.facts.wall_s = running.Seconds();
  run.facts.options = OptionTexts(settings_->registry);
  run.facts.unreadable = images_.unreadable();
  run.facts.damaged = dataset_->damaged();
  if (!options_.system.localise_only)
    NameImages(run.atlas, *dataset_, &run.facts.map_origin.image_names);
  run.facts.calibration = DescribeCalibration(dataset_->stored_camera(),
                                              dataset_->Calibration().text, run.camera, lens_);
  return run;
}

/// To what counts of soft images; to what maps that are gone on with were seen at.
void DatasetRun::LimitSeenPixels(const std::optional<LoadedAtlas>& loaded,
                                 const std::function<bool()>& stop) {
  CheckModels(options_);
  const auto pixels = loaded ? PixelsSeenBefore(loaded->origin, options_.features)
                             : FindSoftPixels(options_, request_.range, stop, dataset_.get());
  if (pixels) options_.features.LimitPixels(*pixels);
}

RunFacts DatasetRun::FactsBefore(const Eyes& eyes, const std::optional<LoadedAtlas>& loaded) const {
  RunFacts facts = FactsOf(eyes, *settings_);
  facts.dataset_path = AbsolutePath(request_.dataset);
  facts.dataset_kind = dataset_->Kind();
  facts.camera_file = AbsolutePath(request_.camera);
  facts.schedule = request_.schedule;
  facts.images = images_.count();
  facts.use = request_.use;
  facts.map_origin = OriginOf(loaded, eyes, options_.system.localise_only);
  facts.first_new_keyframe = KeyframeId{loaded ? loaded->atlas.ids().keyframes : 0};
  return facts;
}

void DatasetRun::RunAsSurvey(const Camera& camera, Eyes* eyes, const RunHooks& hooks,
                             FinishedRun* run) {
  const SurveyHooks survey_hooks{
      .progress = [&](FrameId frame) { hooks.progress(frame, "features"); },
      .work = hooks.work,
      .stop = hooks.stop,
      .observer = hooks.observer};
  SurveyRun survey = RunSurvey(camera, dataset_->Calibration().focal_sigma, options_.system,
                               eyes->perception(), &images_, survey_hooks, sensors_.streams);
  SurveyAgain(camera, survey_hooks, &survey);
  run->result = std::move(survey.result);
  run->atlas = std::move(survey.outcome.atlas);
  run->camera = std::move(survey.outcome.camera);
  NameUnplaced(run->result, *dataset_);
  lens_ = survey.outcome.lens;
}

void DatasetRun::RunInOrder(const Camera& camera, Eyes* eyes, std::optional<LoadedAtlas> loaded,
                            const RunHooks& hooks, FinishedRun* run) {
  const bool may_begin_anew = schedule_ != Schedule::kLive && !loaded;
  Pass pass = PassOver(camera, options_.system, eyes, std::move(loaded), hooks);
  const bool follows_doubt = may_begin_anew && PassAgain(camera, hooks, &pass);
  if (pass.result.focal_doubt && !may_begin_anew)
    Log().warn("a camera.yaml with `model: auto` has the focal length found");
  run->result = std::move(pass.result);
  run->atlas = std::move(pass.atlas);
  run->camera = pass.camera;
  lens_ = RefinedBy(run->result, run->camera, lens_);
  if (follows_doubt)
    run->result.focal_doubt = {run->camera.pinhole.fx / camera.pinhole.fx, lens_->sigmas.focal};
}

DatasetRun::Pass DatasetRun::PassOver(const Camera& camera, const SystemOptions& options,
                                      Eyes* eyes, std::optional<LoadedAtlas> loaded,
                                      const RunHooks& hooks, const ImageRegion& left_out) {
  Slam slam(camera, options, eyes->perception());
  slam.LeaveOut(left_out);
  if (told_pinhole_) slam.TellPinhole(*told_pinhole_);
  if (loaded) slam.Load(std::move(loaded->atlas));
  slam.UseSensors(sensors_.streams);
  slam.Observe(hooks.observer);
  Pass pass;
  pass.result = slam.Run(
      &images_, schedule_,
      [&](const FrameRecord& record) {
        hooks.progress(record.id, record.located() ? "tracking" : record.reason);
      },
      hooks.stop);
  pass.atlas = slam.TakeAtlas();
  pass.camera = slam.camera();
  return pass;
}

}  // namespace deepuav
