#include "deepuav/simulation/rendering/sensor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "deepuav/simulation/rendering/parallel_rows.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

constexpr int kGammaSteps = 1 << 16;

// Nearly normal, mean 0 and deviation 1: a sum of four uniform numbers.
float NormalFromBits(uint64_t bits) {
  const auto sum = static_cast<float>((bits & 0xffff) + ((bits >> 16) & 0xffff) +
                                      ((bits >> 32) & 0xffff) + (bits >> 48));
  constexpr float kDeviation = 37837.2f;  // sqrt(4 / 12) * 2^16
  return (sum - 2 * 65535.0f) / kDeviation;
}

}  // namespace

ExposureSetting SettingFor(const SensorOptions& options, double scale) {
  const double wanted_s = scale * options.sunlit_exposure_s;
  const double duration_s = std::clamp(wanted_s, options.min_exposure_s, options.max_exposure_s);
  return {duration_s, std::clamp(wanted_s / duration_s, 1.0, options.max_gain)};
}

double MeteredScale(const SensorOptions& options, const std::vector<float>& radiances) {
  constexpr int kIterations = 12;
  // A power of a product is the product of the powers: one for each radiance, one for each scale.
  std::vector<double> levels;
  levels.reserve(radiances.size());
  for (const float radiance : radiances)
    levels.push_back(std::pow(std::max<double>(radiance, 0), 1 / options.gamma));
  const double darkest = std::pow(1e-6, 1 / options.gamma);
  double scale = 1;
  for (int i = 0; i < kIterations; ++i) {
    const double level_scale = std::pow(scale, 1 / options.gamma);
    double sum = 0;
    for (const double level : levels) sum += std::clamp(level_scale * level, darkest, 1.0);
    const double mean = sum / static_cast<double>(std::max<size_t>(1, radiances.size()));
    scale *= std::pow(options.mean_level / mean, options.gamma);
  }
  return scale;
}

Sensor::Sensor(const SensorOptions& options, cv::Size size, uint64_t seed, int threads)
    : options_(options), seed_(seed), threads_(threads), vignette_(size) {
  const double half_x = (size.width - 1) / 2.0, half_y = (size.height - 1) / 2.0;
  const double corner2 = std::max(1e-9, half_x * half_x + half_y * half_y);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double r2 = ((x - half_x) * (x - half_x) + (y - half_y) * (y - half_y)) / corner2;
      vignette_(y, x) = static_cast<float>(1 - options.vignetting * r2);
    }
  }
  for (int i = 0; i < kGammaSteps; ++i) {
    const double level = 255 * std::pow(i / (kGammaSteps - 1.0), 1 / options.gamma);
    gamma_levels_.push_back(cv::saturate_cast<uint8_t>(level));
  }
}

GreyImage Sensor::Develop(cv::Mat1f radiance, const ExposureSetting& exposure,
                          int frame_index) const {
  cv::multiply(radiance, vignette_, radiance);
  if (options_.defocus_px > 0) cv::GaussianBlur(radiance, radiance, {}, options_.defocus_px);

  GreyImage image(radiance.size());
  const auto full_well = static_cast<float>(options_.full_well_electrons);
  const auto read_variance =
      static_cast<float>(options_.read_noise_electrons * options_.read_noise_electrons);
  const auto electrons_per_radiance =
      static_cast<float>(full_well * exposure.duration_s / options_.sunlit_exposure_s);
  const auto steps_per_electron = static_cast<float>(exposure.gain * (kGammaSteps - 1)) / full_well;
  const uint64_t frame_seed = MixBits(seed_ ^ MixBits(static_cast<uint64_t>(frame_index)));
  ForRowsInParallel(image.rows, threads_, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      const uint64_t row_seed = MixBits(frame_seed + static_cast<uint64_t>(y));
      for (int x = 0; x < image.cols; ++x) {
        const float mean = radiance(y, x) * electrons_per_radiance;
        const float noise = NormalFromBits(MixBits(row_seed + static_cast<uint64_t>(x)));
        const float electrons = mean + std::sqrt(mean + read_variance) * noise;
        // In this order of arguments what is no number becomes 0.
        const float step =
            std::min(kGammaSteps - 1.0f, std::max(0.0f, electrons * steps_per_electron));
        image(y, x) = gamma_levels_[static_cast<size_t>(step)];
      }
    }
  });
  if (options_.jpeg_quality > 0) {
    std::vector<uint8_t> bytes;
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, options_.jpeg_quality});
    image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  }
  return image;
}

}  // namespace deepuav
