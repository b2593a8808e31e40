#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

struct CorrectedCalibration {
  CalibrationSigmas sigmas;
  double shift_px = 0;  ///< By which it was corrected, in the mean of the image.
};

/// Corrects what is searched for of a calibration that a map contradicts, in `camera`, in all maps
/// and in what the frames saw, and adjusts this map again. Nothing where the calibration stays.
std::optional<CorrectedCalibration> CorrectCalibration(MapId map, const LensSearchOptions& options,
                                                       Mapper* mapper, Camera* camera,
                                                       std::vector<FrameRecord>* records,
                                                       const std::function<bool()>& stop);

/// Whether a map says that the focal length it was made with is wrong; nothing is changed. Nothing
/// where the map does not contradict it, and of an equidistant lens.
std::optional<FocalDoubt> DoubtFocal(MapId map, const LensSearchOptions& options,
                                     const Camera& camera, const Mapper& mapper,
                                     const std::function<bool()>& stop);

}  // namespace deepuav
