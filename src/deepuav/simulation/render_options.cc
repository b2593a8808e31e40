#include "deepuav/simulation/render_options.h"

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/options.h"

namespace deepuav {

void SensorOptions::Check() const {
  const auto check = [](bool holds, const char* name, double value, const char* expected) {
    CheckOption(holds, name, value, expected);
  };
  CheckRange("sensor.min_exposure_s", min_exposure_s, 1e-7, 1);
  check(max_exposure_s >= min_exposure_s && max_exposure_s <= 1, "sensor.max_exposure_s",
        max_exposure_s, "at least the shortest exposure, and at most 1");
  CheckRange("sensor.sunlit_exposure_s", sunlit_exposure_s, 1e-7, 1);
  CheckRange("sensor.max_gain", max_gain, 1, 10'000);
  CheckRange("sensor.mean_level", mean_level, 0.01, 0.99);
  CheckRange("sensor.exposure_lag_s", exposure_lag_s, 0, 1000);
  check(rolling_shutter_readout_s >= 0 && rolling_shutter_readout_s <= 1,
        "sensor.rolling_shutter_readout_s", rolling_shutter_readout_s, "0 to 1");
  check(samples >= 1 && samples <= 256, "sensor.samples", samples, "1 to 256");
  check(vignetting >= 0 && vignetting < 1, "sensor.vignetting", vignetting, "0 up to 1");
  check(defocus_px >= 0 && defocus_px <= 50, "sensor.defocus_px", defocus_px, "0 to 50");
  CheckRange("sensor.full_well_electrons", full_well_electrons, 1, 1e9);
  CheckRange("sensor.read_noise_electrons", read_noise_electrons, 0, 1e6);
  CheckRange("sensor.gamma", gamma, 0.1, 4);
  check(jpeg_quality >= 0 && jpeg_quality <= 100, "sensor.jpeg_quality", jpeg_quality, "0 to 100");
  CheckRange("sensor.blind_at_s", blind_at_s, 0, 1e6);
  CheckRange("sensor.blind_for_s", blind_for_s, 0, 1e6);
}

void WeatherOptions::Check() const {
  CheckOption(sun_elevation_deg > 0 && sun_elevation_deg <= 90, "weather.sun_elevation_deg",
              sun_elevation_deg, "above 0, at most 90");
  CheckOption(sun_azimuth_deg >= -360 && sun_azimuth_deg <= 360, "weather.sun_azimuth_deg",
              sun_azimuth_deg, "-360 to 360");
  CheckRange("weather.sun", sun, 0, 100);
  CheckRange("weather.sky", sky, 1e-6, 100);
  CheckOption(clouds >= 0 && clouds <= 1, "weather.clouds", clouds, "0 to 1");
  CheckRange("weather.visibility_m", visibility_m, 1, 1e7);
  CheckOption(rain_mm_h >= 0 && rain_mm_h <= 200, "weather.rain_mm_h", rain_mm_h, "0 to 200");
  CheckOption(wind_m_s >= -50 && wind_m_s <= 50, "weather.wind_m_s", wind_m_s, "-50 to 50");
}

void RenderOptions::Check() const {
  sensor.Check();
  weather.Check();
  CheckRange("render.threads", threads, 0, 1024);
}

}  // namespace deepuav
