#pragma once

#include <functional>
#include <optional>

#include "deepuav/assembly/run_options.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/survey/survey_adjustment.h"

namespace deepuav {

/// A lens found from the images themselves, at the working size.
struct SampleCalibration {
  Camera camera;
  RefinedLens lens;
};

/// The lens of a dataset whose calibration is no more than a guess, by a survey of some images from
/// its middle; nothing for a better source, and where these do not tell it.
std::optional<SampleCalibration> CalibrateFromSample(Dataset* dataset, const RunOptions& options,
                                                     const std::function<bool()>& stop);

}  // namespace deepuav
