#pragma once

#include <optional>
#include <string>

#include "deepuav/estimation/bundle_adjustment.h"
#include "deepuav/io/dataset.h"

namespace deepuav {

/// The camera that a run ended with, in pixels of the images as they are stored.
struct FoundCalibration {
  Camera camera;
  std::string source;  ///< Where the values that it started from are from.
  double start_focal_px = 0;
  std::optional<CalibrationSigmas> sigmas;  ///< Where it was refined.
  double readout_s = 0;                     ///< Of a rolling shutter; 0: not told.
};

/// `camera` is the dataset's working camera as the run left it.
FoundCalibration DescribeCalibration(const Dataset& dataset, const Camera& camera,
                                     const std::optional<CalibrationSigmas>& sigmas);

/// A camera.yaml that `run --camera` takes, with the standard deviations as comments.
std::string CalibrationYaml(const FoundCalibration& calibration);

/// One line for a person.
std::string CalibrationText(const FoundCalibration& calibration);

}  // namespace deepuav
