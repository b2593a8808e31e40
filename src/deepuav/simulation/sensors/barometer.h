#pragma once

#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/random.h"
#include "deepuav/sensors/samples.h"
#include "deepuav/simulation/flight/flight_path.h"

namespace deepuav {

struct BarometerOptions {
  double rate_hz = 20;
  double noise_m = 0.1;
  double drift_m = 0.5;
  double drift_correlation_s = 300;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rate_hz", rate_hz, "Hz", "samples a second", Between(0.001, 1000));
    visit("noise_m", noise_m, "m", "standard deviation of the white error", Between(0, 1000));
    visit("drift_m", drift_m, "m", "standard deviation of the weather's slow error",
          Between(0, 1000));
    visit("drift_correlation_s", drift_correlation_s, "s", "in which its correlation falls to 1/e",
          Between(0.001, 1e6));
  }
};

/// Pressure at an altitude of the standard atmosphere (ISO 2533, troposphere), and back.
double StandardPressurePa(double altitude_m);
double StandardAltitudeM(double pressure_pa);

/// The samples of a barometer in the body's origin from time 0 to `duration_s`; `start`: the time
/// stamp of time 0; `origin_altitude_m`: altitude of the world's height 0.
std::vector<BarometerSample> SimulateBarometer(const FlightPath& path,
                                               const BarometerOptions& options,
                                               double origin_altitude_m, double duration_s,
                                               Timestamp start, Random* random);

}  // namespace deepuav
