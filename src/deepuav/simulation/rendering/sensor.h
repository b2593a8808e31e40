#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "deepuav/image/image.h"
#include "deepuav/simulation/rendering/render_options.h"

namespace deepuav {

/// How long and at which gain, so that the written picture has the mean level wanted.
struct ExposureSetting {
  double duration_s;
  double gain;
};

/// `scale`: the written level of radiance 1 over its saturation. Lengthens the exposure first, then
/// raises the gain.
ExposureSetting SettingFor(const SensorOptions& options, double scale);

/// The scale under which radiances, cut off at saturation, have the mean level after gamma.
double MeteredScale(const SensorOptions& options, const std::vector<float>& radiances);

/// From light to the written picture: vignetting, defocus, exposure, shot and read noise, gamma, 8
/// bits, JPEG.
class Sensor {
 public:
  Sensor(const SensorOptions& options, cv::Size size, uint64_t seed, int threads);

  /// `radiance` is used up.
  GreyImage Develop(cv::Mat1f radiance, const ExposureSetting& exposure, int frame_index) const;

 private:
  SensorOptions options_;
  uint64_t seed_;
  int threads_;
  cv::Mat1f vignette_;
  std::vector<uint8_t> gamma_levels_;
};

}  // namespace deepuav
