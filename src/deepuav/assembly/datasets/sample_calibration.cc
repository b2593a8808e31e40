#include "deepuav/assembly/datasets/sample_calibration.h"

#include <algorithm>
#include <cmath>

#include "deepuav/assembly/datasets/dataset_images.h"
#include "deepuav/assembly/networks/eyes.h"
#include "deepuav/base/logging.h"
#include "deepuav/system/photos/photo_survey.h"

namespace deepuav {
namespace {

/// What is known better, as a calibration, is held while a map is made; the lens of what is known
/// less, as of approximate values by hand, is not known at all.
constexpr double kGuessSigma = 0.05;
/// A shutter that takes longer rolls.
constexpr double kRollingS = 0.008;
/// What a sample's lens errs by, over its standard deviations, and at least as a share of the focal
/// length.
constexpr double kSampleTrust = 2, kLeastSampleError = 0.002;
/// The lens counts if the map holds this share of them and tells the focal length so well.
constexpr double kMinShare = 0.5, kMaxFocalSigma = 0.05;
/// As far from a told focal length, at least, as a share of it and of the way to where the map
/// would have it, lies one that confirms the doubt: a few images err, too.
constexpr double kConfirmedError = 0.03, kConfirmedShare = 0.5;

FrameRange SampleOf(const Dataset& dataset, const FrameRange& within = {}) {
  const double rate_hz = dataset.camera().rate_hz;
  const int end = within.end < 0 ? dataset.size() : std::min(within.end, dataset.size());
  const int count = end - within.start;
  int stride = std::max(1, static_cast<int>(std::lround(rate_hz * kSampleIntervalS)));
  stride = std::max(1, std::min(stride, count / kSampleImages + 1));
  const int span = std::min(count, stride * kSampleImages);
  const int start = within.start + (count - span) / 2;
  return {start, start + span, stride};
}

}  // namespace

bool IsGuess(double focal_sigma) { return focal_sigma >= kGuessSigma; }

std::optional<SampleCalibration> CalibrateFromImages(const Camera& camera, double focal_sigma,
                                                     const RunOptions& options, ImageSource* images,
                                                     const std::function<bool()>& stop) {
  Eyes eyes(camera, options.OfPhotographs());
  const SurveyRun survey =
      RunSurvey(camera, focal_sigma, options.system, eyes.perception(), images, {.stop = stop});
  const auto located = std::count_if(survey.result.frames.begin(), survey.result.frames.end(),
                                     [](const FrameRecord& frame) { return frame.located(); });
  const auto& lens = survey.outcome.lens;
  const double share =
      static_cast<double>(located) / std::max<size_t>(1, survey.result.frames.size());
  if (!lens || share < kMinShare || lens->sigmas.focal > kMaxFocalSigma) {
    Log().warn("the images do not tell the lens: it stays as it was");
    return std::nullopt;
  }
  Log().info("focal length found from {} images: {:.1f} px of {} px across", located,
             survey.outcome.camera.pinhole.fx, survey.outcome.camera.width);
  return SampleCalibration{survey.outcome.camera, *lens};
}

void MendLensAtEnd(double focal_sigma, SystemOptions* options) {
  options->refine_focal = false;
  options->mapping.lens.whole = true;
  options->mapping.lens.focal_sigma = focal_sigma;
  options->mapping.readout.refine_known = true;
}

void MendLensAtEnd(const RefinedLens& sample, SystemOptions* options) {
  MendLensAtEnd(kGuessSigma, options);
  // What a sample could not explain, as how the camera turned while its rows were read, leaves the
  // centre unrefined, or bends the lens.
  const bool explains_all = sample.sigmas.centre > 0 && sample.sigmas.focal > 0;
  if (!explains_all || sample.readout_s > kRollingS) return;
  const auto error = [](double sigma) { return std::max(kLeastSampleError, kSampleTrust * sigma); };
  LensSearchOptions& lens = options->mapping.lens;
  lens.focal_sigma = std::min(lens.focal_sigma, error(sample.sigmas.focal));
  lens.centre_sigma = std::min(lens.centre_sigma, error(sample.sigmas.centre));
}

std::optional<SampleCalibration> CalibrateFromSample(Dataset* dataset, const RunOptions& options,
                                                     const std::function<bool()>& stop) {
  const double focal_sigma = dataset->Calibration().focal_sigma;
  if (!IsGuess(focal_sigma)) return std::nullopt;
  DatasetImages images(dataset, SampleOf(*dataset));
  return CalibrateFromImages(dataset->camera(), focal_sigma, options, &images, stop);
}

Camera OfUnknownLens(Camera camera) {
  camera.lens = LensModel::kPinhole;
  camera.distortion.clear();
  return camera;
}

bool Confirms(double found_px, double told_px, double fitting_ratio) {
  const double moved = std::log(found_px / told_px);
  const bool confirms =
      std::abs(moved) >= kConfirmedError && moved / std::log(fitting_ratio) >= kConfirmedShare;
  Log().warn("the images by themselves have {:.3f} times the focal length that was told: {}",
             found_px / told_px,
             confirms ? "that is followed" : "that is not enough, and it stays as it was told");
  return confirms;
}

std::optional<SampleCalibration> ConfirmBySample(double fitting_ratio, Dataset* dataset,
                                                 const FrameRange& within,
                                                 const RunOptions& options,
                                                 const std::function<bool()>& stop) {
  const Camera camera = OfUnknownLens(dataset->camera());
  DatasetImages images(dataset, SampleOf(*dataset, within));
  auto sample = CalibrateFromImages(camera, kDoubtedFocalSigma, options, &images, stop);
  if ((stop && stop()) || !sample) return std::nullopt;
  const bool confirms = Confirms(sample->camera.pinhole.fx, camera.pinhole.fx, fitting_ratio);
  return confirms ? sample : std::nullopt;
}

}  // namespace deepuav
