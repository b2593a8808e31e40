#include "deepuav/simulation/sensors/barometer.h"

#include <cmath>

#include "deepuav/base/option_check.h"
#include "deepuav/sensors/standard_gravity.h"
#include "deepuav/simulation/sensors/sensor_clock.h"
#include "deepuav/simulation/sensors/sensor_noise.h"

namespace deepuav {
namespace {

// ISO 2533: sea level, and the lapse rate up to 11 km.
constexpr double kSeaLevelPa = 101325;
constexpr double kSeaLevelK = 288.15;
constexpr double kLapseKPerM = 0.0065;
constexpr double kExponent = kStandardGravity_m_s2 / (287.05287 * kLapseKPerM);

}  // namespace

void BarometerOptions::Check() const { CheckOptions("barometer", *this); }

double StandardPressurePa(double altitude_m) {
  return kSeaLevelPa * std::pow(1 - kLapseKPerM * altitude_m / kSeaLevelK, kExponent);
}

double StandardAltitudeM(double pressure_pa) {
  return kSeaLevelK / kLapseKPerM * (1 - std::pow(pressure_pa / kSeaLevelPa, 1 / kExponent));
}

std::vector<BarometerSample> SimulateBarometer(const FlightPath& path,
                                               const BarometerOptions& options,
                                               double origin_altitude_m, double duration_s,
                                               Timestamp start, Random* random) {
  GaussMarkov drift(options.drift_m, options.drift_correlation_s, random);
  const double step_s = 1 / options.rate_hz;
  const int count = SampleCount(duration_s, options.rate_hz);
  std::vector<BarometerSample> samples;
  samples.reserve(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double height_m = path.At(i * step_s).world_from_body.translation().z();
    const double altitude_m =
        origin_altitude_m + height_m + drift.value() + random->Gaussian(options.noise_m);
    samples.push_back({After(start, i * step_s), StandardPressurePa(altitude_m), altitude_m});
    drift.Advance(step_s, random);
  }
  return samples;
}

}  // namespace deepuav
