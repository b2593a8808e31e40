#include "deepuav/system/finish/calibration_correction.h"

#include <algorithm>
#include <cmath>

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

/// Of a focal length that does not move, over itself.
constexpr double kHeld = 1e-7;

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
  LensSearchOptions search = options;
  search.whole = mapper->SearchesWholeLens();
  // What contradicts a wrong lens most was taken for outliers while it was made: each round finds
  // less of it.
  for (int round = 0; round < options.max_rounds && !stop(); ++round) {
    const bool is_first = round == 0 && !search.whole;
    search.min_cost_share = is_first ? std::min(options.min_cost_share, options.min_large_share)
                                     : options.min_later_share;
    const std::optional<FoundLens> found = mapper->SearchLens(map, search, stop);
    if (!found) break;
    const auto correction = search.whole
                                ? LensCorrection::To(found->camera, *camera)
                                : LensCorrection::Of(*camera, found->camera, options.max_error_px);
    if (!correction || (is_first && !IsTold(*found, *correction, options))) break;
    Log().info("the calibration is corrected by {:.2f} px, in the mean of the image",
               correction->MeanShiftPx());
    if (search.whole) mapper->TakeAdjusted(map, found->adjusted);
    Apply(*correction, mapper, records);
    *camera = correction->camera();
    if (!corrected) corrected.emplace();
    corrected->sigmas = found->sigmas;
    corrected->shift_px = MeanShiftPx(before, *camera);
    mapper->AdjustGlobally(map, &camera->pinhole, false, stop);
  }
  return corrected;
}

std::optional<FocalDoubt> DoubtFocal(MapId map, const LensSearchOptions& options,
                                     const Camera& camera, const Mapper& mapper,
                                     const std::function<bool()>& stop) {
  if (camera.lens == LensModel::kEquidistant) return std::nullopt;
  LensSearchOptions search = options;
  search.whole = true;
  search.min_cost_share = -1;  // By whatever it saves.
  search.focal_sigma = options.doubted_focal_sigma;
  const std::optional<FoundLens> free = mapper.SearchLens(map, search, stop);
  if (!free) return std::nullopt;
  const FocalDoubt doubt{free->camera.pinhole.fx / camera.pinhole.fx, free->sigmas.focal};
  const double error = std::abs(std::log(doubt.ratio));
  if (error < options.min_focal_error || error < options.min_focal_sigmas * doubt.sigma)
    return std::nullopt;
  // What a wrong distortion or centre costs is not the focal length's.
  search.focal_sigma = kHeld;
  const std::optional<FoundLens> held = mapper.SearchLens(map, search, stop);
  if (!held) return std::nullopt;
  const double share = 1 - (1 - free->cost_share) / (1 - held->cost_share);
  Log().debug("a focal length of {:.4f} times the told one saves {:.2f} % of what any lens leaves",
              doubt.ratio, 100 * share);
  if (share < options.min_focal_share) return std::nullopt;
  Log().warn("the images contradict the focal length: a {} one fits better, by {:.0f} % or more",
             doubt.ratio > 1 ? "longer" : "shorter", 100 * std::abs(doubt.ratio - 1));
  return doubt;
}

}  // namespace deepuav
