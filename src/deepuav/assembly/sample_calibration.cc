#include "deepuav/assembly/sample_calibration.h"

#include <algorithm>
#include <cmath>

#include "deepuav/assembly/dataset_images.h"
#include "deepuav/base/logging.h"
#include "deepuav/system/photo_survey.h"

namespace deepuav {
namespace {

/// A source that is trusted less is a guess.
constexpr double kGuessSigma = 0.3;
/// So many images, so far apart: near enough to overlap, far enough to show parallax.
constexpr int kSampleImages = 60;
constexpr double kSampleIntervalS = 0.3;
/// The lens counts if the map holds this share of them and tells the focal length so well.
constexpr double kMinShare = 0.5, kMaxFocalSigma = 0.05;

FrameRange SampleOf(const Dataset& dataset) {
  const double rate_hz = dataset.camera().rate_hz;
  const int count = dataset.size();
  int stride = std::max(1, static_cast<int>(std::lround(rate_hz * kSampleIntervalS)));
  stride = std::max(1, std::min(stride, count / kSampleImages + 1));
  const int span = std::min(count, stride * kSampleImages);
  const int start = (count - span) / 2;
  return {start, start + span, stride};
}

}  // namespace

std::optional<SampleCalibration> CalibrateFromSample(Dataset* dataset, const RunOptions& options,
                                                     const std::function<bool()>& stop) {
  const double focal_sigma = dataset->Calibration().focal_sigma;
  if (focal_sigma < kGuessSigma) return std::nullopt;
  DatasetImages images(dataset, SampleOf(*dataset));
  Eyes eyes(dataset->camera(), options);
  const SurveyRun survey = RunSurvey(dataset->camera(), focal_sigma, options.system,
                                     eyes.perception(), &images, {.stop = stop});
  const auto located = std::count_if(survey.result.frames.begin(), survey.result.frames.end(),
                                     [](const FrameRecord& frame) { return frame.located(); });
  const auto& lens = survey.outcome.lens;
  const double share =
      static_cast<double>(located) / std::max<size_t>(1, survey.result.frames.size());
  if (!lens || share < kMinShare || lens->sigmas.focal > kMaxFocalSigma) {
    Log().warn("the images do not tell the lens: the guess is kept");
    return std::nullopt;
  }
  Log().info("focal length found from {} images: {:.1f} px of {} px across", located,
             survey.outcome.camera.pinhole.fx, survey.outcome.camera.width);
  return SampleCalibration{survey.outcome.camera, *lens};
}

}  // namespace deepuav
