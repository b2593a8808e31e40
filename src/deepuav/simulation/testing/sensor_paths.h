#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "deepuav/simulation/flight/quadrotor_path.h"

namespace deepuav {

inline constexpr Timestamp kStart{1'700'000'000'000'000'000};

inline QuadrotorPath BentPath() {
  std::vector<double> times_s;
  std::vector<FlatOutput> values;
  for (int i = 0; i <= 30; ++i) {
    times_s.push_back(i);
    values.emplace_back(20 * std::cos(0.3 * i), 15 * std::sin(0.4 * i), 20 + 0.2 * i, 0.3 * i);
  }
  Random random(3);
  return QuadrotorPath({MinimumSnapCurve(times_s, values)}, {false, 0.1},
                       WindJitter(WindOptions{}, &random), std::nullopt);
}

/// At one place, turned by yaw.
class StillPath : public FlightPath {
 public:
  explicit StillPath(double duration_s, double yaw = 0)
      : duration_s_(duration_s), pose_(RotationExp({0, 0, yaw}), Eigen::Vector3d(100, 200, 50)) {}
  double duration_s() const override { return duration_s_; }
  BodyState At(double /*time_s*/) const override { return {pose_}; }

 private:
  double duration_s_;
  SE3 pose_;
};

}  // namespace deepuav
