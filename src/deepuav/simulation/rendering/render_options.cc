#include "deepuav/simulation/rendering/render_options.h"

#include "deepuav/base/option_check.h"

namespace deepuav {

void SensorOptions::Check() const { CheckOptions("sensor", *this); }

void SensorOptions::CheckRelations() const {
  CheckOption(max_exposure_s >= min_exposure_s, "max_exposure_s", max_exposure_s,
              "at least sensor.min_exposure_s");
}

void WeatherOptions::Check() const { CheckOptions("weather", *this); }

void RenderOptions::Check() const {
  CheckOptions("render", *this);
  sensor.Check();
  weather.Check();
}

}  // namespace deepuav
