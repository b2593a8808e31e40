#pragma once

#include <functional>

#include "deepuav/sensors/streams.h"
#include "deepuav/survey/survey_mapper.h"
#include "deepuav/system/photos/survey_telling.h"
#include "deepuav/system/slam.h"

namespace deepuav {

/// Who is told of a survey while it goes on, and may end it.
struct SurveyHooks {
  std::function<void(FrameId)> progress = {};  ///< For each photograph once its features are there.
  SurveyTelling::Work work = {};               ///< What follows, step by step.
  /// Ends the reading of photographs early, and what follows after options.finish_stopped_s.
  std::function<bool()> stop = {};
  RunObserver* observer = nullptr;
};

/// What a survey leaves behind: as a run, and the maps.
struct SurveyRun {
  SlamResult result;
  SurveyOutcome outcome;
};

/// Makes maps of all photographs at once (SurveyMapper). `camera` as the extractor's;
/// `focal_sigma`: how far its focal length is to be trusted, 0 for a calibrated one. Where
/// `sensors` holds position fixes the maps are then given their place on Earth.
SurveyRun RunSurvey(const Camera& camera, double focal_sigma, const SystemOptions& options,
                    const Perception& perception, ImageSource* images,
                    const SurveyHooks& hooks = {}, const SensorStreams& sensors = {});

}  // namespace deepuav
