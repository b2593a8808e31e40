#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

/// What the angles of a gimbal are trusted with: their errors are mostly the same in all images.
struct AttitudeNoise {
  double tilt_sigma_deg = 1;      ///< Of what they say is level.
  double heading_sigma_deg = 10;  ///< By a compass.
  double max_spread_deg = 10;     ///< From their mean, of those that agree with it...
  double min_agreeing = 0.75;     ///< ...who are at least this share, else none is believed.
  int min_samples = 3;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("tilt_sigma_deg", tilt_sigma_deg, "deg",
          "standard deviation of what the angles say is level, in the mean of a flight",
          Between(0.001, 180));
    visit("heading_sigma_deg", heading_sigma_deg, "deg", "the same of north, which is by a compass",
          Between(0.001, 180));
    visit("max_spread_deg", max_spread_deg, "deg",
          "turn of an image's angles from the mean of all, as the map sees the images, with which "
          "they agree",
          Above(0, 180));
    visit("min_agreeing", min_agreeing, "",
          "share of the images that agree, below which none is believed", Above(0, 1));
    visit("min_samples", min_samples, "", "images with angles without which none is believed",
          Between(1, 1'000'000));
  }
};

/// How a path lies on Earth, but for its place and scale.
struct OrientationPrior {
  Eigen::Quaterniond local_from_world = Eigen::Quaterniond::Identity();  ///< East, north, up.
  double tilt_sigma_rad = 0, heading_sigma_rad = 0;
};

struct OrientationAttempt {
  std::optional<OrientationPrior> found;
  std::string reason;  ///< Why nothing was found, for a person.
};

/// The mean of what the images' attitudes say of the path, of those that agree with most others.
/// Refused, with the reason, where few lie on the path or agree.
OrientationAttempt OrientationByAttitudes(const Trajectory& path,
                                          const std::vector<AttitudeSample>& attitudes,
                                          const AttitudeNoise& noise);

}  // namespace deepuav
