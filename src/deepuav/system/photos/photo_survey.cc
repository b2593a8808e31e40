#include "deepuav/system/photos/photo_survey.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/base/time.h"
#include "deepuav/image/image_store.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/finish/calibration_correction.h"
#include "deepuav/system/frames/frame_feed.h"
#include "deepuav/system/sensors/georeferencing.h"
#include "deepuav/system/sensors/placed_maps.h"
#include "deepuav/system/watching/stage_clock.h"

namespace deepuav {
namespace {

/// Clockwise: under these headings all photographs are described, for pairs of all headings.
constexpr int kTurnsDescribed[] = {1, 2};

SurveyView ViewOf(Frame frame, TurnedDescriber* turned, ImageStore* images,
                  TemporaryFile* turned_file, StageClock* clock) {
  SurveyView view;
  if (turned) {
    const StageScope stage(clock, "turned descriptors");
    for (const int turns : kTurnsDescribed) {
      view.turned[static_cast<size_t>(turns) - 1] = {
          turned->DescribeTurned(frame.image->image(), *frame.features, turns), turned_file};
    }
  }
  if (frame.image) {
    view.image_number = images->Add(std::move(frame.image));
    view.images = images;
  }
  view.frame = std::move(frame);
  view.frame.image.reset();
  return view;
}

/// The rows of the key points outside of the region.
StoredDescriptors RowsOutside(const ImageRegion& region, const Features& features,
                              const StoredDescriptors& stored, TemporaryFile* file) {
  if (stored.size() == 0) return stored;
  const Descriptors all = stored.Load();
  Descriptors outside(all.dimension());
  for (int i = 0; i < features.size(); ++i) {
    if (!region.Covers(features.keypoints[static_cast<size_t>(i)].image_px))
      outside.AppendFrom(all, i);
  }
  return {std::move(outside), file};
}

/// Leaves out what all photographs show at the same place, as writing or parts of the vehicle.
void LeaveOutWhatIsFixed(const Camera& camera, const ImageFixedOptions& options,
                         TemporaryFile* turned_file, std::vector<SurveyView>* views,
                         SlamResult* result) {
  std::vector<std::shared_ptr<const Features>> photographs;
  for (const SurveyView& view : *views) photographs.push_back(view.frame.features);
  const ImageRegion region = FixedInPhotographs(photographs, camera.width, camera.height, options);
  result->image_fixed = region;
  if (region.empty()) return;
  int64_t all = 0, left = 0;
  for (SurveyView& view : *views) {
    for (StoredDescriptors& turned : view.turned)
      turned = RowsOutside(region, *view.frame.features, turned, turned_file);
    all += view.frame.features->size();
    view.frame.features = Outside(region, view.frame.features);
    left += view.frame.features->size();
  }
  result->image_fixed_keypoint_share = 1 - static_cast<double>(left) / static_cast<double>(all);
  Log().info(
      "something fixed to the camera hides {:.1f} % of the photographs, where {:.1f} % of the key "
      "points lie: it is left out",
      100 * region.Share(), 100 * result->image_fixed_keypoint_share);
}

/// About where the photographs were taken, which says which of them may show the same ground.
void PlaceByFixes(const GnssStream& gnss, const SensorUseOptions& options,
                  std::vector<SurveyView>* views) {
  if (gnss.fixes.empty()) return;
  const GeoPoint origin = PlaceOf(gnss.fixes.front());
  std::vector<Timestamp> times;
  for (const SurveyView& view : *views) times.push_back(view.frame.time);
  const auto positions_m = PositionsAt(times, LocalFixes(gnss.fixes, origin, options.gnss),
                                       options.gnss_clock_offset_s, options.georeference.max_gap_s);
  for (size_t v = 0; v < views->size(); ++v) (*views)[v].position_m = positions_m[v];
  Log().debug("{} of {} photographs have a position by the fixes",
              std::ranges::count_if(positions_m, [](const auto& at) { return at.has_value(); }),
              views->size());
}

FrameRecord RecordOf(const Frame& frame, const SurveyOutcome& outcome,
                     const SurveyOutcome::Place& place) {
  FrameRecord record;
  record.id = frame.id;
  record.time = frame.time;
  record.keypoint_count = frame.features->size();
  if (!place.map.valid()) {
    record.reason = "no other photograph shows enough of the same ground";
    return record;
  }
  const Keyframe& keyframe = outcome.atlas.At(place.map).At(place.keyframe);
  record.state = TrackingState::kTracking;
  record.tracked_online = true;
  record.map = place.map;
  record.pose = {keyframe.id, SE3(), keyframe.scale};
  record.cam_from_world = keyframe.cam_from_world;
  record.landmark_count = keyframe.LandmarkCount();
  return record;
}

/// The lens under which the same undistorted pixels belong to rays of another focal length.
void ScaleFocalLength(const Pinhole& pinhole, Camera* camera) {
  const double scale = pinhole.fx / camera->pinhole.fx;
  camera->pinhole = pinhole;
  if (camera->distortion.empty()) return;
  std::vector<double>& distortion = camera->distortion;
  constexpr int kPowers[] = {2, 4, 1, 1};  // Of the radius, beside k1, k2, p1, p2.
  for (size_t i = 0; i < std::min(distortion.size(), std::size(kPowers)); ++i)
    distortion[i] *= std::pow(scale, kPowers[i]);
}

/// Whether the largest map contradicts the focal length that it was told, and that it keeps.
void AskForFocalLength(const SystemOptions& options, StageClock* clock,
                       const std::function<bool()>& stop, SurveyRun* run) {
  Atlas& atlas = run->outcome.atlas;
  if (!options.mapping.lens.enabled || atlas.Remaining().empty()) return;
  const Mapper mapper(run->outcome.camera, options.mapping, &atlas, clock);
  run->result.focal_doubt =
      DoubtFocal(atlas.BySize().front(), options.mapping.lens, run->outcome.camera, mapper, stop);
}

/// In the lens that the survey found: that is kept, but for its focal length, which fixes to
/// centimetres tell.
void GeoreferenceSurvey(const SensorStreams& sensors, const SystemOptions& options,
                        StageClock* clock, const std::function<bool()>& stop, SurveyRun* run) {
  if (sensors.gnss.fixes.empty() || run->outcome.atlas.Remaining().empty()) return;
  const StageScope stage(clock, "georeference");
  Camera& camera = run->outcome.camera;
  const bool lens_is_open = run->outcome.lens && camera.lens != LensModel::kEquidistant;
  Atlas& atlas = run->outcome.atlas;
  Mapper mapper(camera, options.mapping, &atlas, clock);
  Georeferencing georeferencing(sensors, options.sensors, {}, &mapper, &atlas);
  const MapId largest = atlas.BySize().front();
  const bool refines = lens_is_open && georeferencing.TellsFocalLength();
  Pinhole pinhole = camera.pinhole;
  run->result.georeferences = georeferencing.ApplyToAll(
      atlas.Remaining(), run->result.frames, &pinhole,
      [&](MapId map) { return refines && map == largest; }, stop);
  run->result.maps_joined_by_fixes = JoinPlacedMaps(options.sensors.georeference.join_max_sigma_m,
                                                    &run->result.georeferences, &mapper, &atlas);
  ScaleFocalLength(pinhole, &camera);
  for (FrameRecord& record : run->result.frames) {
    if (record.located()) record.cam_from_world = atlas.At(record.map).PoseOf(record.pose);
  }
}

void TellDoubts(const std::vector<Frame>& frames, SurveyRun* run) {
  const std::vector<int>& doubtful = run->outcome.doubtful;
  run->result.doubtful_photographs = static_cast<int>(doubtful.size());
  if (doubtful.empty()) return;
  std::string numbers;
  for (const int view : doubtful)
    numbers += fmt::format("{}{}", numbers.empty() ? "" : ", ",
                           frames[static_cast<size_t>(view)].id.value);
  Log().warn(
      "{} photographs match others that lie elsewhere in the map, which may be wrong there: {}",
      doubtful.size(), numbers);
}

}  // namespace

SurveyRun RunSurvey(const Camera& camera, double focal_sigma, const SystemOptions& options,
                    const Perception& perception, ImageSource* images, const SurveyHooks& hooks,
                    const SensorStreams& sensors) {
  const std::function<bool()>& stop = hooks.stop;
  SurveyRun run;
  StageClock clock;
  if (RunObserver* const observer = hooks.observer) {
    clock.Tell([observer](const std::string& stage, double seconds) {
      observer->OnStage(stage, seconds);
    });
  }
  SurveyTelling telling(hooks.observer, hooks.work);
  ImageStore kept_images(options.survey.images_in_memory);
  TemporaryFile turned_file;
  std::vector<SurveyView> views;
  {
    SequentialFeed sequential(images, perception.extractor, &clock);
    PrefetchingFeed feed(&sequential, options.frames_ahead);
    while (!(stop && stop())) {
      std::optional<Frame> frame = feed.Next();
      if (!frame) break;
      const FrameId id = frame->id;
      telling.TellOfPhotograph(*frame);
      views.push_back(
          ViewOf(std::move(*frame), perception.turned, &kept_images, &turned_file, &clock));
      if (hooks.progress) hooks.progress(id);
    }
  }
  LeaveOutWhatIsFixed(camera, options.image_fixed, &turned_file, &views, &run.result);
  // What was seen until then is still made a map, for a while.
  Stopwatch since_stop;
  const auto late = [&] {
    if (!run.result.stopped && stop && stop()) {
      run.result.stopped = true;
      since_stop.Restart();
    }
    return run.result.stopped && since_stop.Seconds() > options.finish_stopped_s;
  };
  Matcher* quick = perception.quick_matcher ? perception.quick_matcher : perception.matcher;
  Matcher* learned = perception.matcher_is_learned ? perception.matcher : nullptr;
  SurveyMapper mapper(camera, focal_sigma, options.survey,
                      {quick, learned, perception.vocabulary, perception.reduced, perception.turned,
                       &turned_file, learned ? learned : perception.learned_matcher},
                      &clock,
                      {options.patches, options.mapping.model_noise, options.mapping.surface});
  mapper.Watch(&telling);
  std::vector<Frame> frames;
  for (const SurveyView& view : views) frames.push_back(view.frame);
  try {
    PlaceByFixes(sensors.gnss, options.sensors, &views);
    run.outcome = mapper.Run(std::move(views), late);
  } catch (const std::exception& error) {
    run.result.failure = error.what();
    run.outcome.places.resize(frames.size());
    run.outcome.camera = camera;
  }
  TellDoubts(frames, &run);
  for (size_t v = 0; v < frames.size(); ++v) {
    run.result.frames.push_back(RecordOf(frames[v], run.outcome, run.outcome.places[v]));
  }
  try {
    if (focal_sigma == 0) AskForFocalLength(options, &clock, late, &run);
    GeoreferenceSurvey(sensors, options, &clock, late, &run);
    const StageScope stage(&clock, "covariances");
    run.result.covariances =
        EstimateMapCovariances(run.outcome.atlas, run.outcome.camera.pinhole,
                               options.mapping.global_bundle, run.result.georeferences, late);
  } catch (const std::exception& error) {
    if (run.result.failure.empty()) run.result.failure = error.what();
  }
  telling.TellOfMaps(run.outcome.atlas);
  run.result.stage_durations_s = clock.Durations();
  return run;
}

}  // namespace deepuav
