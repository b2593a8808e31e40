#include "deepuav/simulation/flight/quadrotor_path.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

struct Attitude {
  Eigen::Quaterniond world_from_body;
  Eigen::Vector3d angular_velocity_body;
};

// Thrust axis and yaw to attitude, and their derivatives to the angular velocity: y is at right
// angles to the thrust and to where yaw points.
Attitude AttitudeOfThrust(const Eigen::Vector3d& thrust, const Eigen::Vector3d& thrust_rate,
                          double yaw, double yaw_rate) {
  const Eigen::Vector3d heading(std::cos(yaw), std::sin(yaw), 0);
  const Eigen::Vector3d heading_rate = yaw_rate * Eigen::Vector3d(-heading.y(), heading.x(), 0);
  const Eigen::Vector3d z = thrust.normalized();
  const Eigen::Vector3d y = z.cross(heading).normalized();
  const Eigen::Vector3d x = y.cross(z);
  Eigen::Matrix3d rotation;
  rotation << x, y, z;
  const Eigen::Vector3d z_rate = (thrust_rate - z * z.dot(thrust_rate)) / thrust.norm();
  const double about_x = -y.dot(z_rate);
  const double about_y = x.dot(z_rate);
  const double about_z = (about_x * z.dot(heading) + y.dot(heading_rate)) / x.dot(heading);
  return {Eigen::Quaterniond(rotation), {about_x, about_y, about_z}};
}

}  // namespace

void AttitudeOptions::Check() const { CheckOptions("attitude", *this); }

QuadrotorPath::QuadrotorPath(std::vector<MinimumSnapCurve> curves, const AttitudeOptions& attitude,
                             const WindJitter& wind, std::optional<Kidnap> kidnap)
    : curves_(std::move(curves)), attitude_(attitude), wind_(wind), kidnap_(kidnap) {
  if (curves_.empty()) throw Error("a flight without a curve: expected at least one");
  double end_s = 0;
  for (const MinimumSnapCurve& curve : curves_) {
    end_s += curve.end_s() - curve.start_s();
    curve_ends_s_.push_back(end_s);
  }
  if (!kidnap_) return;
  CheckOption(kidnap_->at_s > 0 && kidnap_->at_s < end_s, "course.kidnap_at_s", kidnap_->at_s,
              fmt::format("between 0 and the course's {:.1f} s", end_s));
  CheckOption(kidnap_->to_s >= 0 && kidnap_->to_s < end_s, "course.kidnap_to_s", kidnap_->to_s,
              fmt::format("from 0 to the course's {:.1f} s", end_s));
}

double QuadrotorPath::duration_s() const {
  const double course_s = curve_ends_s_.back();
  return kidnap_ ? kidnap_->at_s + course_s - kidnap_->to_s : course_s;
}

FlatState QuadrotorPath::CourseAt(double course_s) const {
  const auto end = std::upper_bound(curve_ends_s_.begin(), curve_ends_s_.end() - 1, course_s);
  const auto i = static_cast<size_t>(end - curve_ends_s_.begin());
  const double start_s = i == 0 ? 0 : curve_ends_s_[i - 1];
  return curves_[i].At(curves_[i].start_s() + course_s - start_s);
}

BodyState QuadrotorPath::At(double time_s) const {
  const double t = std::clamp(time_s, 0.0, duration_s());
  const FlatState course =
      CourseAt(kidnap_ && t >= kidnap_->at_s ? t - kidnap_->at_s + kidnap_->to_s : t);
  const Eigen::Vector3d velocity = course.velocity.head<3>();
  const Eigen::Vector3d acceleration = course.acceleration.head<3>();
  Eigen::Vector3d thrust = Eigen::Vector3d(0, 0, kGravityMps2), thrust_rate(0, 0, 0);
  if (!attitude_.gimbal) {
    thrust += acceleration + attitude_.rotor_drag_per_s * velocity;
    thrust_rate = course.jerk.head<3>() + attitude_.rotor_drag_per_s * acceleration;
  }
  const Attitude steady =
      AttitudeOfThrust(thrust, thrust_rate, course.value.w(), course.velocity.w());

  const Swing shake = wind_.Position(t), turn = wind_.Rotation(t);
  const Eigen::Quaterniond steady_from_body = RotationExp(turn.value);
  BodyState state;
  state.world_from_body =
      SE3(steady.world_from_body * steady_from_body, course.value.head<3>() + shake.value);
  state.velocity_world = velocity + shake.velocity;
  state.acceleration_world = acceleration + shake.acceleration;
  // Exp(v + d) = Exp(v) Exp(J_l(-v) d) to first order.
  state.angular_velocity_body = steady_from_body.conjugate() * steady.angular_velocity_body +
                                RotationLeftJacobian(-turn.value) * turn.velocity;
  return state;
}

}  // namespace deepuav
