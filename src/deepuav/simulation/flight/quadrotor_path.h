#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/simulation/flight/flight_path.h"
#include "deepuav/simulation/flight/minimum_snap_curve.h"
#include "deepuav/simulation/flight/wind_jitter.h"

namespace deepuav {

inline constexpr double kGravityMps2 = 9.81;

/// How the body holds itself on its course.
struct AttitudeOptions {
  /// The body is a platform that the gimbal keeps level, else the airframe, which tilts.
  bool gimbal = true;
  double rotor_drag_per_s = 0.12;  ///< Leans the airframe forward in flight.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("gimbal", gimbal, "",
          "camera and sensors on a level platform, not on the tilting airframe");
    visit("rotor_drag_per_s", rotor_drag_per_s, "1/s",
          "drag per speed and mass (Faessler et al. 2018), by which the airframe leans into flight",
          Between(0, 10));
  }
};

/// A moment at which the flight goes on from elsewhere, as after being carried off in a bag.
struct Kidnap {
  double at_s = 0;  ///< Of the flight as recorded.
  double to_s = 0;  ///< Time along the course at which it goes on.
};

/// The flight of a quadrotor along curves of its flat outputs, one after the other, shaken by wind.
/// The airframe's z axis is along the thrust, which carries weight, acceleration and rotor drag;
/// yaw says where x points (Mellinger and Kumar, ICRA 2011).
class QuadrotorPath : public FlightPath {
 public:
  /// Each curve starts where the one before it rests; their own start times do not matter. Throws
  /// Error when there is none or the kidnap's times lie outside.
  QuadrotorPath(std::vector<MinimumSnapCurve> curves, const AttitudeOptions& attitude,
                const WindJitter& wind, std::optional<Kidnap> kidnap);

  double duration_s() const override;
  /// At the kidnap's own moment it is already elsewhere.
  BodyState At(double time_s) const override;

 private:
  FlatState CourseAt(double course_s) const;

  std::vector<MinimumSnapCurve> curves_;
  std::vector<double> curve_ends_s_;
  AttitudeOptions attitude_;
  WindJitter wind_;
  std::optional<Kidnap> kidnap_;
};

}  // namespace deepuav
