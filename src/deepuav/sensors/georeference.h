#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/option_check.h"
#include "deepuav/geometry/sim3.h"
#include "deepuav/sensors/orientation_prior.h"
#include "deepuav/sensors/positions_on_path.h"

namespace deepuav {

/// When a path is told its place on Earth.
struct GeoreferenceOptions {
  int min_fixes = 5;               ///< On the path, outliers not counted.
  double outlier_sigmas = 4;       ///< Distance of an outlier, over the spread of the others.
  double max_scale_sigma = 0.1;    ///< Standard deviation of the scale, as a share of it.
  double max_turn_sigma_deg = 10;  ///< Of the map's orientation, about any axis.
  double level_sigma_deg = 5;      ///< How level the camera's x axes are taken to be, all together.
  double max_gap_s = 2;            ///< Of path and fixes, to interpolate in.
  double join_max_sigma_m = 10;  ///< Of where fixes have what two maps show, that become one by it.
  double running_window_s = 240;  ///< Latest part of fixes by which it is told while it grows...
  double running_pose_interval_s = 0.25;  ///< ...from poses that are so far apart...
  double running_wait_s = 2;              ///< ...tried so often until something is found...
  double running_longest_wait_s = 20;     ///< ...then more seldom, up to this.
  /// Of the scale, as a share, and of the orientation, in rad, with which it is told meanwhile: who
  /// steers by it bears less than who looks at it afterwards.
  double running_max_sigma = 0.05;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_fixes", min_fixes, "", "fixes on the path without which its place is not told",
          Between(3, 1'000'000));
    visit("outlier_sigmas", outlier_sigmas, "",
          "distance of an outlier from the path, over the spread of the other fixes",
          Above(0, 1000));
    visit("max_scale_sigma", max_scale_sigma, "",
          "standard deviation of the scale, as a share, above which the place is not told",
          Above(0, 10));
    visit("max_turn_sigma_deg", max_turn_sigma_deg, "deg",
          "the same of the orientation, about any axis", Above(0, 180));
    visit("level_sigma_deg", level_sigma_deg, "deg",
          "how level the camera's horizontal axes are taken to be, all together",
          Between(0.001, 180));
    visit("max_gap_s", max_gap_s, "s", "longest gap of path or fixes that is interpolated",
          Between(0, 1e6));
    visit("join_max_sigma_m", join_max_sigma_m, "m",
          "maps that fixes have put on Earth become one where these tell to so much, as a standard "
          "deviation, where what each shows lies; 0: never",
          Between(0, 1e6));
    visit("running_window_s", running_window_s, "s",
          "latest part of the fixes by which a place is told while the run goes on",
          Between(1, 86'400));
    visit("running_pose_interval_s", running_pose_interval_s, "s", "between two poses of that part",
          Between(0.01, 60));
    visit("running_wait_s", running_wait_s, "s",
          "before it is looked for again while there is none", Between(0.1, 3600));
    visit("running_longest_wait_s", running_longest_wait_s, "s", "the same once there is one",
          Between(0.1, 3600));
    visit(
        "running_max_sigma", running_max_sigma, "",
        "standard deviation of the scale, as a share, and of the orientation, in rad, above which "
        "no place is told while the run goes on",
        Above(0, 3));
  }
  void CheckRelations() const {
    CheckOption(running_wait_s <= running_longest_wait_s, "running_wait_s", running_wait_s,
                "at most running_longest_wait_s");
  }
};

/// The order of the parameters of a georeference.
enum GeoreferenceParameter { kTurn = 0, kShift = 3, kLogScale = 6, kClockOffset = 7 };
using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

/// Where a map lies on Earth.
struct Georeference {
  Sim3 local_from_world;                   ///< Metres east, north and up.
  Matrix8d covariance = Matrix8d::Zero();  ///< Of a turn and shift from the left, the logarithm of
                                           ///< the scale, the clock offset.
  double clock_offset_s = 0;               ///< To be added to the fixes' times.
  /// Spread of the fixes about the path, east and north, and up, over what they state; at least 1
  /// where they state it.
  double horizontal_ratio = 1, vertical_ratio = 1;
  double horizontal_rms_m = 0, vertical_rms_m = 0;  ///< Of the fixes used.
  /// So many fixes tell as much as one whose error is independent of the others'.
  double fixes_per_independent = 1;
  bool by_carrier = false;                ///< The fixes state to be of the carrier's phase.
  std::vector<PositionOnPath> positions;  ///< As given to Georeferencer, times on the camera's
                                          ///< clock.
  std::vector<uint8_t> outlier;           ///< One per position.

  int used() const;
  double scale_sigma() const;     ///< Relative.
  double turn_sigma_rad() const;  ///< About the least certain axis.
  /// Of where a point of the path's world lies; m^2.
  Eigen::Matrix3d PositionCovariance(const Eigen::Vector3d& world) const;
  /// The standard deviations that position i shall count with where all are taken as independent;
  /// metres.
  Eigen::Vector3d IndependentSigma(size_t i) const;
};

/// The clock of a receiver: its offset is searched about 0 where sigma is above 0, else it is
/// `offset_s`.
struct ClockPrior {
  double offset_s = 0, sigma_s = 0;
};

/// That a path is in metres and its z axis points up, by an inertial sensor.
struct MetricPrior {
  double scale_sigma = 0;  ///< As a share of the scale.
  double tilt_sigma_rad = 0;
};

/// What is known of a path beside its fixes.
struct PlacePriors {
  std::optional<MetricPrior> metric = {};
  std::optional<OrientationPrior> orientation = {};
};

struct GeoreferenceAttempt {
  std::optional<Georeference> found;
  std::string reason;  ///< Why nothing was found, for a person.
};

/// Whether most fixes state so little that they are by the carrier's phase with corrections.
bool AreByCarrier(const std::vector<LocalFix>& fixes, const GnssNoise& noise);

/// Finds the similarity (and, where its prior leaves it open, the clock offset) under which the
/// antenna's path lies nearest to the fixes: hypotheses from three fixes each, judged by the median
/// distance, then iteratively reweighted least squares over all that are no outliers. The errors of
/// fixes count as correlated over `noise.correlation_s`. Refused, with the reason, where fixes are
/// too few or their covariance leaves scale or orientation open: straight or short flights, or a
/// hover. What is `known` counts beside the fixes. The same input gives the same result.
GeoreferenceAttempt FindGeoreference(const Trajectory& path, const std::vector<LocalFix>& fixes,
                                     const Eigen::Vector3d& antenna_cam_m, const ClockPrior& clock,
                                     const GnssNoise& noise, const GeoreferenceOptions& options,
                                     const PlacePriors& known = {});

}  // namespace deepuav
