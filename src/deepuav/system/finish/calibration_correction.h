#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// Corrects the distortion of a calibration that a map contradicts, in `camera`, in all maps and in
/// what the frames saw, and adjusts this map again. Standard deviations of what was found; nothing
/// where the calibration stays.
std::optional<CalibrationSigmas> CorrectCalibration(MapId map, const LensSearchOptions& options,
                                                    Mapper* mapper, Camera* camera,
                                                    std::vector<FrameRecord>* records,
                                                    const std::function<bool()>& stop);

}  // namespace deepuav
