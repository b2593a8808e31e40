#include "deepuav/system/finish/calibration_correction.h"

#include <algorithm>

#include "deepuav/base/logging.h"
#include "deepuav/estimation/bundle/lens_correction.h"

namespace deepuav {
namespace {

void Apply(const LensCorrection& correction, Mapper* mapper, std::vector<FrameRecord>* records) {
  const PixelMove move = [&correction](const Eigen::Vector2f& px) -> Eigen::Vector2f {
    return correction.Correct(px.cast<double>()).cast<float>();
  };
  mapper->ChangeCamera(correction.camera(), move);
  for (FrameRecord& record : *records) MovePixels(move, &record);
}

/// Noise hides a small share of it, and more where images are blurred or compressed.
bool IsTold(const FoundLens& found, const LensCorrection& correction,
            const LensSearchOptions& options) {
  return found.cost_share >= options.min_cost_share ||
         (found.cost_share >= options.min_large_share &&
          correction.MeanShiftPx() >= options.large_px);
}

}  // namespace

std::optional<CorrectedCalibration> CorrectCalibration(MapId map, const LensSearchOptions& options,
                                                       Mapper* mapper, Camera* camera,
                                                       std::vector<FrameRecord>* records,
                                                       const std::function<bool()>& stop) {
  const Camera before = *camera;
  std::optional<CorrectedCalibration> corrected;
  // What contradicts a wrong lens most was taken for outliers while it was made: each round finds
  // less of it.
  for (int round = 0; round < options.max_rounds && !stop(); ++round) {
    const bool is_whole = mapper->SearchesWholeLens(), is_first = round == 0 && !is_whole;
    const double min_cost_share = is_first
                                      ? std::min(options.min_cost_share, options.min_large_share)
                                      : options.min_later_share;
    const std::optional<FoundLens> found = mapper->SearchLens(map, min_cost_share, stop);
    if (!found) break;
    const auto correction = is_whole
                                ? LensCorrection::To(found->camera, *camera)
                                : LensCorrection::Of(*camera, found->camera, options.max_error_px);
    if (!correction || (is_first && !IsTold(*found, *correction, options))) break;
    Log().info("the calibration is corrected by {:.2f} px, in the mean of the image",
               correction->MeanShiftPx());
    if (is_whole) mapper->TakeAdjusted(map, found->adjusted);
    Apply(*correction, mapper, records);
    *camera = correction->camera();
    if (!corrected) corrected.emplace();
    corrected->sigmas = found->sigmas;
    corrected->shift_px = MeanShiftPx(before, *camera);
    mapper->AdjustGlobally(map, &camera->pinhole, false, stop);
  }
  return corrected;
}

}  // namespace deepuav
