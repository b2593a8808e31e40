#include "deepuav/simulation/sensors/gnss.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>
#include <limits>

#include "deepuav/base/option_check.h"
#include "deepuav/simulation/sensors/sensor_clock.h"
#include "deepuav/simulation/sensors/sensor_noise.h"

namespace deepuav {
namespace {

constexpr double kSecondsPerMinute = 60;

double Exponential(double mean, Random* random) {
  return -mean * std::log(1 - random->Uniform(0, 1));
}

/// When there is no fix, asked at growing times.
class Dropouts {
 public:
  Dropouts(const GnssOptions& options, Random* random) : options_(options) { Plan(0, random); }

  bool Covers(double time_s, Random* random) {
    while (time_s >= end_s_) Plan(end_s_, random);
    return time_s >= begin_s_;
  }

 private:
  void Plan(double from_s, Random* random) {
    begin_s_ = end_s_ = std::numeric_limits<double>::infinity();
    if (options_.dropouts_per_min == 0 || options_.dropout_s == 0) return;
    begin_s_ = from_s + Exponential(kSecondsPerMinute / options_.dropouts_per_min, random);
    end_s_ = begin_s_ + Exponential(options_.dropout_s, random);
  }

  const GnssOptions& options_;
  double begin_s_ = 0, end_s_ = 0;
};

}  // namespace

void GnssOptions::Check() const { CheckOptions("gnss", *this); }

std::vector<GnssFix> SimulateGnss(const FlightPath& path, const GnssOptions& options,
                                  double duration_s, Timestamp start, Random* random) {
  const GeographicLib::LocalCartesian local(
      options.origin_latitude_deg, options.origin_longitude_deg, options.origin_altitude_m);
  const Eigen::Vector3d drift_m(options.horizontal_drift_m, options.horizontal_drift_m,
                                options.vertical_drift_m);
  const Eigen::Vector3d noise_m(options.horizontal_noise_m, options.horizontal_noise_m,
                                options.vertical_noise_m);
  const Eigen::Vector3d sigma_m = (drift_m.cwiseAbs2() + noise_m.cwiseAbs2()).cwiseSqrt();
  std::vector<GaussMarkov> drift;
  for (int axis = 0; axis < 3; ++axis)
    drift.emplace_back(drift_m[axis], options.drift_correlation_s, random);
  Dropouts dropouts(options, random);
  const double step_s = 1 / options.rate_hz;
  const int count = SampleCount(duration_s, options.rate_hz);
  std::vector<GnssFix> samples;
  for (int i = 0; i < count; ++i) {
    const double time_s = i * step_s;
    Eigen::Vector3d position = path.At(time_s).world_from_body * options.Lever();
    for (int axis = 0; axis < 3; ++axis) {
      GaussMarkov& slow = drift[static_cast<size_t>(axis)];
      position[axis] += slow.value() + random->Gaussian(noise_m[axis]);
      slow.Advance(step_s, random);
    }
    if (dropouts.Covers(time_s, random)) continue;
    GnssFix& sample = samples.emplace_back();
    sample.time = After(start, time_s + options.clock_offset_s);
    sample.sigma_m = sigma_m;
    local.Reverse(position.x(), position.y(), position.z(), sample.latitude_deg,
                  sample.longitude_deg, sample.altitude_m.emplace());
  }
  return samples;
}

}  // namespace deepuav
