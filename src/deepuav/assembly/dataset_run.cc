#include "deepuav/assembly/dataset_run.h"

#include <filesystem>

#include "deepuav/assembly/wrong_use.h"
#include "deepuav/io/options_file.h"
#include "deepuav/system/photo_survey.h"

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
  if (dataset_->CalibrationIsApproximate()) options_.system.refine_focal = true;
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
    loaded =
        LoadMaps(request_.map, dataset_->camera(), dataset_->CalibrationIsApproximate(), &options_);
  const bool is_survey = IsSurvey();
  std::optional<SampleCalibration> sample;
  if (!loaded && !is_survey) sample = CalibrateFromSample(dataset_.get(), options_, hooks.stop);
  if (sample) {
    options_.system.refine_focal = false;
    lens_ = sample->lens;
  }
  const Camera camera = loaded ? loaded->camera : sample ? sample->camera : dataset_->camera();
  Eyes eyes(camera, options_);
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
  run.facts.unreadable = images_.unreadable();
  run.facts.damaged = dataset_->damaged();
  if (!options_.system.localise_only)
    NameImages(run.atlas, *dataset_, &run.facts.map_origin.image_names);
  run.facts.calibration = DescribeCalibration(dataset_->stored_camera(),
                                              dataset_->Calibration().text, run.camera, lens_);
  return run;
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
  run->result = std::move(survey.result);
  run->atlas = std::move(survey.outcome.atlas);
  run->camera = std::move(survey.outcome.camera);
  lens_ = survey.outcome.lens;
}

void DatasetRun::RunInOrder(const Camera& camera, Eyes* eyes, std::optional<LoadedAtlas> loaded,
                            const RunHooks& hooks, FinishedRun* run) {
  Slam slam(camera, options_.system, eyes->perception());
  if (loaded) slam.Load(std::move(loaded->atlas));
  slam.UseSensors(std::move(sensors_.streams));
  slam.Observe(hooks.observer);
  run->result = slam.Run(
      &images_, schedule_,
      [&](const FrameRecord& record) {
        hooks.progress(record.id, record.located() ? "tracking" : record.reason);
      },
      hooks.stop);
  run->atlas = slam.TakeAtlas();
  run->camera = slam.camera();
  if (run->result.lens) lens_ = RefinedLens{*run->result.lens, 0};
  if (run->result.readout) {
    if (!lens_) lens_.emplace();
    lens_->readout_s = run->camera.readout_s;
    lens_->sigmas.readout_s = run->result.readout->sigma_s;
  }
}

}  // namespace deepuav
