#pragma once

#include <functional>
#include <optional>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/bundle/bundle_camera.h"
#include "deepuav/map/map.h"
#include "deepuav/mapping/adjustment/bundle_window.h"

namespace deepuav {

/// How far a calibration is trusted, and when what a map says against it counts. Only its radial
/// distortion is searched for, as focal length and centre take up what else does not fit, such as a
/// shutter's readout; but for one that a few images told, of which all may be off. A told focal
/// length may be put in doubt.
struct LensSearchOptions {
  bool enabled = true;
  double radial_sigma = 0.05;       ///< Of a calibration's k1 and k2.
  bool whole = false;               ///< Searches for all of the lens.
  double focal_sigma = 0.05;        ///< Of the focal length then, over itself...
  double centre_sigma = 0.01;       ///< ...of the principal point, over the focal length...
  double tangential_sigma = 0.003;  ///< ...and of p1 and p2.
  int min_keyframes = 20;           ///< In the map.
  double min_cost_share = 0.03;     ///< By which the map's errors must fall...
  double min_large_share = 0.005;   ///< ...or, among the errors of blurred or compressed images...
  double large_px = 1;              ///< ...of a correction of this size in the mean of the image...
  double min_later_share =
      0.0001;  ///< ...and do in each round after: a calibration found wrong is none to stay near.
  double max_error_px = 0.1;  ///< Of the corrected calibration's lens model, root mean square.
  int max_rounds = 10;        ///< Searches, each in the map that the last one's lens gives.
  double begin_anew_px = 2;   ///< Correction in the mean of the image by which the map was spoilt.
  double doubted_focal_sigma = 0.5;  ///< Of a told focal length, over itself, in doubt; wrong is...
  double min_focal_error = 0.01;     ///< ...one that is so far off...
  double min_focal_sigmas = 5;       ///< ...by so many standard deviations...
  double min_focal_share = 0.005;    ///< ...for so much of the errors that any other lens leaves.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit(
        "enabled", enabled, "",
        "correct the distortion of a calibration that a map contradicts, at the end of a run, and "
        "say where it contradicts the focal length");
    visit("radial_sigma", radial_sigma, "", "standard deviation of a calibration's k1 and k2",
          Above(0, 100));
    visit("whole", whole, "",
          "correct all of the lens, by any share of the errors, as of one that a few images told");
    visit("focal_sigma", focal_sigma, "",
          "standard deviation of such a focal length, as a share of it", Above(0, 10));
    visit("centre_sigma", centre_sigma, "",
          "standard deviation of such a principal point, as a share of the focal length",
          Above(0, 1));
    visit("tangential_sigma", tangential_sigma, "", "standard deviation of such p1 and p2",
          Above(0, 1));
    visit("min_keyframes", min_keyframes, "", "keyframes of a map that may contradict",
          Between(2, 1'000'000));
    visit("min_cost_share", min_cost_share, "",
          "share of the cost of a map's errors that a first correction must save", Between(0, 1));
    visit("min_large_share", min_large_share, "",
          "share of the cost of a map's errors that a first correction of large_px must save",
          Between(0, 1));
    visit("large_px", large_px, "px",
          "correction, root mean square over the image, from which min_large_share is enough",
          Between(0, 1e6));
    visit("min_later_share", min_later_share, "",
          "share of the cost of a map's errors that each later correction must save",
          Between(0, 1));
    visit("max_error_px", max_error_px, "px",
          "error of the lens model that stands for the corrected calibration, at most, root mean "
          "square over the image",
          Above(0, 100));
    visit("max_rounds", max_rounds, "", "searches, each in the map that the last one's lens gives",
          Between(1, 100));
    visit(
        "begin_anew_px", begin_anew_px, "px",
        "correction in the mean of the image from which on a dataset is run once more with it from "
        "its first image on",
        Above(0, 1e6));
    visit("doubted_focal_sigma", doubted_focal_sigma, "",
          "standard deviation of a told focal length, as a share of it, when the map is asked "
          "whether it is wrong",
          Above(0, 10));
    visit("min_focal_error", min_focal_error, "",
          "error from which on a told focal length is said to be wrong, as a share of it",
          Between(0, 10));
    visit("min_focal_sigmas", min_focal_sigmas, "",
          "the same, in standard deviations of what the map tells", Between(0, 1e6));
    visit("min_focal_share", min_focal_share, "",
          "share of the errors that the rest of the lens leaves which another focal length must "
          "save then",
          Between(0, 1));
  }
};

/// What a map says of the camera that took its undistorted pixels.
struct FoundLens {
  BundleCamera camera;
  CalibrationSigmas sigmas;
  double cost_share = 0;  ///< Of the map's errors that it saves.
  BundleWindow adjusted;  ///< The map as that lens has it.
};

/// A focal length that a map contradicts.
struct FocalDoubt {
  /// Of one under which the map fits better, only a part of the way to the true one, as the map was
  /// made with the told one; or of the one that a run begun anew ended with.
  double ratio = 1;
  double sigma = 0;  ///< Of the ratio, of noise alone.
};

/// How a map of undistorted pixels is adjusted with its lens free, as far as it is searched for.
BundleOptions FreeingTheLens(BundleOptions bundle, const LensSearchOptions& options);

/// Whether all of a lens can be searched for: of Brown's model without k3.
bool IsWhollySearchable(const Camera& camera);

/// All of the lens that took the images under which what was observed fits best, as FindLens.
/// `camera` must be wholly searchable; `told` is what the priors of focal length and principal
/// point are about.
std::optional<FoundLens> FindWholeLens(const Map& map, const Camera& camera, const Pinhole& told,
                                       const BundleOptions& bundle,
                                       const LensSearchOptions& options,
                                       const std::function<bool()>& stop = nullptr);

/// The distortion under which the observations of an adjusted map fit best, poses and landmarks
/// free; they are left as they are. Nothing where `pinhole` alone is about as good. With
/// LensSearchOptions::whole another pinhole as well, for pixels that any lens left undistorted.
std::optional<FoundLens> FindLens(const Map& map, const Pinhole& pinhole,
                                  const BundleOptions& bundle, const LensSearchOptions& options,
                                  const std::function<bool()>& stop = nullptr);

}  // namespace deepuav
