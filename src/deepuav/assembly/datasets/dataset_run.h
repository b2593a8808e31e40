#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/assembly/datasets/dataset_images.h"
#include "deepuav/assembly/datasets/sample_calibration.h"
#include "deepuav/assembly/datasets/sensor_use.h"
#include "deepuav/assembly/maps/loaded_maps.h"
#include "deepuav/assembly/networks/eyes.h"
#include "deepuav/assembly/output/finished_run.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/system/photos/photo_survey.h"

namespace deepuav {

/// Which dataset is run, and how; what the options say comes beside it.
struct DatasetRequest {
  std::string dataset;  ///< Folder or video file.
  std::string camera;   ///< A camera.yaml that overrides the dataset's calibration, or empty.
  std::string map;      ///< A map.deepuav to go on with, or empty.
  std::string schedule = "threaded";
  std::string use = "auto";  ///< Sensors, as ReadSensorsUsed.
  FrameRange range;
};

/// Throws WrongUse where a run that only localises has no maps, or no means to find itself in them.
void CheckLocalising(const RunOptions& options, const std::string& map);

/// SLAM over a dataset, a folder of photographs or a video. One run an instance. Not thread-safe.
class DatasetRun {
 public:
  /// Opens the dataset and reads what is used of its sensors. Throws WrongUse for a request that
  /// cannot be, Error for what cannot be read.
  DatasetRun(DatasetRequest request, std::unique_ptr<RunSettings> settings);
  ~DatasetRun();

  int images() const { return images_.count(); }
  /// Photographs are mapped all at once, unless they are to be found in maps that are there or
  /// there are too many.
  bool IsSurvey() const;
  /// Of the images as they are worked on, before the images themselves told more of it.
  const Camera& camera() const { return dataset_->camera(); }

  /// What ends it early is told in the result. Throws Error for networks and maps that are missing,
  /// damaged or do not fit.
  FinishedRun Run(const RunHooks& hooks);

 private:
  void LimitSeenPixels(const std::optional<LoadedAtlas>& loaded, const std::function<bool()>& stop);
  RunFacts FactsBefore(const Eyes& eyes, const std::optional<LoadedAtlas>& loaded) const;
  void RunAsSurvey(const Camera& camera, Eyes* eyes, const RunHooks& hooks, FinishedRun* run);
  void RunInOrder(const Camera& camera, Eyes* eyes, std::optional<LoadedAtlas> loaded,
                  const RunHooks& hooks, FinishedRun* run);

  /// What one way through the images leaves behind.
  struct Pass {
    SlamResult result;
    Atlas atlas;
    Camera camera;
  };
  Pass PassOver(const Camera& camera, const SystemOptions& options, Eyes* eyes,
                std::optional<LoadedAtlas> loaded, const RunHooks& hooks,
                const ImageRegion& left_out = {});
  /// Once more, or more often, where the map was made with what turned out to be wrong. Whether a
  /// told focal length was not followed.
  bool PassAgain(const Camera& told, const RunHooks& hooks, Pass* pass);
  /// Where the map contradicts a told focal length and a sample of the images does, too: once more
  /// with the sample's lens, mended at the end. That camera; or nothing, and `doubted` as it is.
  std::optional<Camera> FollowDoubt(const RunHooks& hooks, Pass* doubted);
  /// The same of photographs that are mapped all at once, by all of them.
  void SurveyAgain(const Camera& told, const SurveyHooks& hooks, SurveyRun* doubted);
  bool PassBySample(const SampleCalibration& sample, const RunHooks& hooks, Pass* doubted);
  void BeginAnew(const RunHooks& hooks);
  /// Whether a pass begun anew ended early: then the first one's results stay, and say so.
  static bool KeepsFirst(const Pass& anew, Pass* first);
  /// Whether the map was made without what the pass found out by its end.
  bool WasSpoilt(const SlamResult& result) const;
  /// Once more, without what `spoilt` left out; with the camera that it ended with where that is
  /// to be relied on, else with the one it began with. False, and `spoilt` as it is, where that
  /// ends early.
  bool PassAnew(const Camera& camera, const RunHooks& hooks, Pass* spoilt);
  /// Whether the map has what nobody told: a readout; writing; any of them, or turns of images,
  /// which bend what it says of a calibration.
  bool HidReadout(const SlamResult& result) const;
  bool HidWriting(const SlamResult& result) const;
  bool WasBent(const SlamResult& result) const;
  /// Whether the map was made with a lens that is not that of its images: one that was guessed, or
  /// that was told and a map contradicts that nothing else has bent.
  bool WasLensOff(const SlamResult& result) const;
  /// Whether a run begun anew told turns of images that the first one did not.
  bool TellsMoreTurns(const std::map<Timestamp, ReadoutMotion>& known,
                      const SlamResult& result) const;

  const Stopwatch since_start_;
  const DatasetRequest request_;
  const std::unique_ptr<RunSettings> settings_;
  RunOptions& options_;
  const Schedule schedule_;
  const std::unique_ptr<Dataset> dataset_;
  DatasetImages images_;
  SensorUse sensors_;
  std::optional<RefinedLens> lens_;      ///< Where the images told it.
  std::optional<Pinhole> told_pinhole_;  ///< Where a run that begins anew knows better.
};

}  // namespace deepuav
