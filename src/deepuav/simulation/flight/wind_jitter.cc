#include "deepuav/simulation/flight/wind_jitter.h"

#include <cmath>
#include <numbers>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr int kSinusoidsPerAxis = 12;
// Forces that shake are as strong at all frequencies, so that displacements are not; the same of
// the rates that the attitude control lets through.
constexpr int kForceFalloff = 2, kRateFalloff = 1, kGustFalloff = 0;
constexpr double kRadiansPerDegree = std::numbers::pi / 180;

}  // namespace

void WindOptions::Check() const { CheckOptions("wind", *this); }

void WindOptions::CheckRelations() const {
  CheckOption(jitter_high_hz >= jitter_low_hz, "jitter_high_hz", jitter_high_hz,
              "at least wind.jitter_low_hz");
  CheckOption(gust_high_hz >= gust_low_hz, "gust_high_hz", gust_high_hz,
              "at least wind.gust_low_hz");
}

BandNoise::BandNoise(double sigma, double low_hz, double high_hz, int falloff, Random* random) {
  const double band_hz = (high_hz - low_hz) / kSinusoidsPerAxis;
  for (int axis = 0; axis < 3; ++axis) {
    const size_t first = sinusoids_.size();
    double variance = 0;
    for (int i = 0; i < kSinusoidsPerAxis; ++i) {
      const double frequency_hz = low_hz + band_hz * (i + random->Uniform(0, 1));
      const double phase = random->Uniform(0, 2 * std::numbers::pi);
      const double amplitude = std::pow(frequency_hz / low_hz, -falloff);
      variance += amplitude * amplitude / 2;
      sinusoids_.push_back({axis, amplitude, 2 * std::numbers::pi * frequency_hz, phase});
    }
    for (size_t i = first; i < sinusoids_.size(); ++i)
      sinusoids_[i].amplitude *= sigma / std::sqrt(variance);
  }
}

Swing BandNoise::At(double time_s) const {
  Swing swing;
  for (const Sinusoid& s : sinusoids_) {
    const double angle = s.angular_frequency * time_s + s.phase;
    const double value = s.amplitude * std::sin(angle);
    swing.value[s.axis] += value;
    swing.velocity[s.axis] += s.amplitude * s.angular_frequency * std::cos(angle);
    swing.acceleration[s.axis] -= s.angular_frequency * s.angular_frequency * value;
  }
  return swing;
}

WindJitter::WindJitter(const WindOptions& options, Random* random)
    : gust_(options.gust_position_m, options.gust_low_hz, options.gust_high_hz, kGustFalloff,
            random),
      jitter_(options.jitter_position_m, options.jitter_low_hz, options.jitter_high_hz,
              kForceFalloff, random),
      rotation_(options.jitter_angle_deg * kRadiansPerDegree, options.jitter_low_hz,
                options.jitter_high_hz, kRateFalloff, random) {}

Swing WindJitter::Position(double time_s) const {
  Swing swing = gust_.At(time_s);
  const Swing jitter = jitter_.At(time_s);
  swing.value += jitter.value;
  swing.velocity += jitter.velocity;
  swing.acceleration += jitter.acceleration;
  return swing;
}

Swing WindJitter::Rotation(double time_s) const { return rotation_.At(time_s); }

}  // namespace deepuav
