#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/random.h"
#include "deepuav/sensors/samples.h"
#include "deepuav/simulation/flight/flight_path.h"

namespace deepuav {

/// A GNSS receiver and where on Earth the world lies.
struct GnssOptions {
  bool present = true;
  double rate_hz = 5;
  double origin_latitude_deg = 47.3977;
  double origin_longitude_deg = 8.5456;
  double origin_altitude_m = 488;
  double horizontal_drift_m = 0.8;
  double vertical_drift_m = 1.5;
  double drift_correlation_s = 60;
  double horizontal_noise_m = 0.15;
  double vertical_noise_m = 0.3;
  double lever_x_m = -0.1;
  double lever_y_m = 0;
  double lever_z_m = 0.12;
  double dropouts_per_min = 1;
  double dropout_s = 3;
  double clock_offset_s = 0;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("present", present, "", "false, as indoors: no fixes are written");
    visit("rate_hz", rate_hz, "Hz", "fixes a second", Between(0.001, 1000));
    visit("origin_latitude_deg", origin_latitude_deg, "deg", "of the world's origin, WGS 84",
          Between(-90, 90));
    visit("origin_longitude_deg", origin_longitude_deg, "deg", "the same", Between(-180, 180));
    visit("origin_altitude_m", origin_altitude_m, "m", "the same, above the ellipsoid",
          Between(-1000, 20'000));
    visit("horizontal_drift_m", horizontal_drift_m, "m",
          "standard deviation of the correlated error, east and north", Between(0, 10'000));
    visit("vertical_drift_m", vertical_drift_m, "m", "the same, up", Between(0, 10'000));
    visit("drift_correlation_s", drift_correlation_s, "s", "in which its correlation falls to 1/e",
          Between(0.001, 1e6));
    visit("horizontal_noise_m", horizontal_noise_m, "m",
          "standard deviation of the white error, east and north", Between(0, 10'000));
    visit("vertical_noise_m", vertical_noise_m, "m", "the same, up", Between(0, 10'000));
    visit("lever_x_m", lever_x_m, "m", "antenna in the body frame, forward", Between(-100, 100));
    visit("lever_y_m", lever_y_m, "m", "the same, to the left", Between(-100, 100));
    visit("lever_z_m", lever_z_m, "m", "the same, up", Between(-100, 100));
    visit("dropouts_per_min", dropouts_per_min, "1/min", "mean number of times without a fix",
          Between(0, 600));
    visit("dropout_s", dropout_s, "s", "mean length of one", Between(0, 3600));
    visit("clock_offset_s", clock_offset_s, "s", "added to the receiver's time stamps",
          Between(-3600, 3600));
  }
  Eigen::Vector3d Lever() const { return {lever_x_m, lever_y_m, lever_z_m}; }
};

/// The fixes of a receiver from time 0 to `duration_s`; `start`: the time stamp of time 0. Errors
/// are a Gauss-Markov process and white noise; dropouts come as a Poisson process, with lengths of
/// an exponential distribution.
std::vector<GnssFix> SimulateGnss(const FlightPath& path, const GnssOptions& options,
                                  double duration_s, Timestamp start, Random* random);

}  // namespace deepuav
