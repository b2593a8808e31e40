#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// How the camera is fixed to the body.
struct CameraMountOptions {
  double pitch_deg = -40;
  double pan_deg = 0;
  double x_m = 0.1;
  double y_m = 0;
  double z_m = -0.03;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("pitch_deg", pitch_deg, "deg", "0 looks ahead, -90 straight down with ahead at the top",
          Between(-90, 90));
    visit("pan_deg", pan_deg, "deg", "to the left", Between(-360, 360));
    visit("x_m", x_m, "m", "camera in the body frame, forward", Between(-100, 100));
    visit("y_m", y_m, "m", "the same, to the left", Between(-100, 100));
    visit("z_m", z_m, "m", "the same, up", Between(-100, 100));
  }
};

SE3 BodyFromCam(const CameraMountOptions& mount);

}  // namespace deepuav
