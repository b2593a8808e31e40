#pragma once

#include <optional>
#include <string>

#include "deepuav/geometry/camera.h"
#include "deepuav/survey/adjustment/survey_adjustment.h"
#include "deepuav/system/slam_result.h"

namespace deepuav {

/// The camera that a run ended with, in pixels of the images as they are stored.
struct FoundCalibration {
  Camera camera;
  std::string source;  ///< Where the values that it started from are from.
  double start_focal_px = 0;
  std::optional<RefinedLens> lens;  ///< Where it was refined.
};

/// How well the lens is known after a run in order of time, where it was told from images before
/// (`before`) or the run found any of it. `camera` is as the run left it.
std::optional<RefinedLens> RefinedBy(const SlamResult& result, const Camera& camera,
                                     const std::optional<RefinedLens>& before);

/// `camera` is the working camera as the run left it, `stored` that of the images as they are
/// stored, before the run; `source` says where that is from.
FoundCalibration DescribeCalibration(const Camera& stored, const std::string& source,
                                     const Camera& camera, const std::optional<RefinedLens>& lens);

/// A camera.yaml that `run --camera` takes, with the standard deviations as comments.
std::string CalibrationYaml(const FoundCalibration& calibration);

/// One line for a person.
std::string CalibrationText(const FoundCalibration& calibration);

}  // namespace deepuav
