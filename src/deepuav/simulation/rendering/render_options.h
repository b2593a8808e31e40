#pragma once

#include "deepuav/base/option_bounds.h"

namespace deepuav {

/// The camera's effects on the picture.
struct SensorOptions {
  double max_exposure_s = 0.012;  ///< Auto-exposure lengthens up to this, then raises the gain.
  double min_exposure_s = 0.00005;
  double sunlit_exposure_s = 0.0015;  ///< In which white under a high sun saturates at gain 1.
  double max_gain = 16;
  double mean_level = 0.4;       ///< Of the written picture, 0 to 1, aimed at by auto-exposure.
  double exposure_lag_s = 0.25;  ///< Time constant of auto-exposure; 0: at once.
  double rolling_shutter_readout_s = 0;  ///< From the first row to the last; 0: global shutter.
  int samples = 1;                    ///< Rays a pixel, spread over exposure time and pixel area.
  double vignetting = 0.25;           ///< Light lost in the corners.
  double defocus_px = 0.5;            ///< Sigma of the Gaussian blur; 0: none.
  double full_well_electrons = 9000;  ///< Shot noise at saturation and gain 1.
  double read_noise_electrons = 8;
  double gamma = 1.5;      ///< Written level = light ^ (1 / gamma).
  int jpeg_quality = 0;    ///< 1 to 100; 0: no JPEG.
  double blind_at_s = 0;   ///< From this moment on no light comes in...
  double blind_for_s = 0;  ///< ...for so long; 0: never.

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;
  bool IsBlindAt(double time_s) const {
    return time_s >= blind_at_s && time_s < blind_at_s + blind_for_s;
  }

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_exposure_s", max_exposure_s, "s", "auto-exposure lengthens up to this",
          Between(1e-7, 1));
    visit("min_exposure_s", min_exposure_s, "s", "shortest exposure", Between(1e-7, 1));
    visit("sunlit_exposure_s", sunlit_exposure_s, "s",
          "exposure in which white under a high sun saturates at gain 1", Between(1e-7, 1));
    visit("max_gain", max_gain, "", "auto-exposure raises the gain up to this", Between(1, 10'000));
    visit("mean_level", mean_level, "", "mean of the written picture aimed at, of white",
          Between(0.01, 0.99));
    visit("exposure_lag_s", exposure_lag_s, "s", "time constant of auto-exposure, 0 for none",
          Between(0, 1000));
    visit("rolling_shutter_readout_s", rolling_shutter_readout_s, "s",
          "time from the first row to the last, 0 for a global shutter", Between(0, 1));
    visit("samples", samples, "", "rays a pixel, spread over exposure and pixel area",
          Between(1, 256));
    visit("vignetting", vignetting, "", "share of the light lost in the corners", Below(0, 1));
    visit("defocus_px", defocus_px, "px", "sigma of the blur by defocus", Between(0, 50));
    visit("full_well_electrons", full_well_electrons, "", "electrons at saturation and gain 1",
          Between(1, 1e9));
    visit("read_noise_electrons", read_noise_electrons, "", "sigma of the read noise",
          Between(0, 1e6));
    visit("gamma", gamma, "", "written level = light ^ (1 / gamma)", Between(0.1, 4));
    visit("jpeg_quality", jpeg_quality, "", "of the compression, 0 for no JPEG", Between(0, 100));
    visit("blind_at_s", blind_at_s, "s", "moment from which no light comes in", Between(0, 1e6));
    visit("blind_for_s", blind_for_s, "s", "for how long, 0 for never", Between(0, 1e6));
  }
};

/// Light and air.
struct WeatherOptions {
  double sun_elevation_deg = 48;
  double sun_azimuth_deg = 140;  ///< Where the sun stands, clockwise from north (y).
  double sun = 1;                ///< Strength of direct light; 1: clear noon, 0: overcast.
  double sky = 0.24;             ///< Strength of the sky's light on level ground.
  double clouds = 0.35;          ///< Share of the sky covered.
  double visibility_m = 6000;    ///< At which contrast falls to 5 %.
  double rain_mm_h = 0;
  double wind_m_s = 3;  ///< Slants the rain, towards x.

  void Check() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("sun_elevation_deg", sun_elevation_deg, "deg", "height of the sun", Above(0, 90));
    visit("sun_azimuth_deg", sun_azimuth_deg, "deg", "where the sun stands, from north to east",
          Between(-360, 360));
    visit("sun", sun, "", "strength of direct light, 1 for a clear noon", Between(0, 100));
    visit("sky", sky, "", "strength of the sky's light", Between(1e-6, 100));
    visit("clouds", clouds, "", "share of the sky covered", Between(0, 1));
    visit("visibility_m", visibility_m, "m", "distance at which contrast falls to 5 %",
          Between(1, 1e7));
    visit("rain_mm_h", rain_mm_h, "mm/h", "rain", Between(0, 200));
    visit("wind_m_s", wind_m_s, "m/s", "wind that slants the rain", Between(-50, 50));
  }
};

struct RenderOptions {
  SensorOptions sensor;
  WeatherOptions weather;
  int seed = 1;     ///< Of the noise.
  int threads = 0;  ///< 0: all cores. The result does not depend on it.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("seed", seed, "", "of the noise", AnySeed());
    visit("threads", threads, "", "0: all cores", Between(0, 1024));
  }
};

}  // namespace deepuav
