#pragma once

#include <functional>
#include <optional>

#include "deepuav/assembly/datasets/dataset_images.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/survey/adjustment/survey_adjustment.h"
#include "deepuav/system/frames/image_source.h"

namespace deepuav {

/// A lens found from the images themselves, at the working size.
struct SampleCalibration {
  Camera camera;
  RefinedLens lens;
};

/// So many images, so far apart, tell a lens: near enough to overlap, far enough to show parallax.
inline constexpr int kSampleImages = 60;
inline constexpr double kSampleIntervalS = 0.3;

/// Whether a lens is to be looked for, which a source that says its focal length this well has not.
bool IsGuess(double focal_sigma);

/// The lens of the camera that took the images, by a survey of them; nothing where they do not tell
/// it. `camera` is of the size of the images, and its focal length known to a share of
/// `focal_sigma`.
std::optional<SampleCalibration> CalibrateFromImages(const Camera& camera, double focal_sigma,
                                                     const RunOptions& options, ImageSource* images,
                                                     const std::function<bool()>& stop);

/// Has a run whose lens is no more than a guess, its focal length known to a share of
/// `focal_sigma`, mend all of it at its end, by all images.
void MendLensAtEnd(double focal_sigma, SystemOptions* options);

/// The same, of one that a sample told: as far as that knew all of it, it counts beside them.
void MendLensAtEnd(const RefinedLens& sample, SystemOptions* options);

/// The lens of a dataset whose calibration is no more than a guess, by images from its middle;
/// nothing for a better source, and where these do not tell it.
std::optional<SampleCalibration> CalibrateFromSample(Dataset* dataset, const RunOptions& options,
                                                     const std::function<bool()>& stop);

/// Of a told focal length that a map contradicts, over itself, as of one that nobody measured.
inline constexpr double kDoubtedFocalSigma = 0.1;

/// The same camera, of whose lens nothing but a guess of the focal length is known: a distortion
/// that was found with a wrong one is none to stay near.
Camera OfUnknownLens(Camera camera);

/// Whether images by themselves say what a map says that fits better with `fitting_ratio` times
/// the told focal length; which is also logged.
bool Confirms(double found_px, double told_px, double fitting_ratio);

/// The same of a dataset whose focal length was told, and a map fits better with `fitting_ratio`
/// times it: what else bends a map may look like that, so nothing where such images, of those
/// `within`, do not say so, too.
std::optional<SampleCalibration> ConfirmBySample(double fitting_ratio, Dataset* dataset,
                                                 const FrameRange& within,
                                                 const RunOptions& options,
                                                 const std::function<bool()>& stop);

}  // namespace deepuav
