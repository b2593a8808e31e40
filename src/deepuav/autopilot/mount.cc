#include "deepuav/autopilot/mount.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kMostDegrees = 360, kMostOffset = 100;

std::optional<Eigen::Vector3d> ThreeNumbers(const std::string& text) {
  Eigen::Vector3d numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int i = 0; i < 3; ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return std::nullopt;
    const auto [next, problem] = std::from_chars(at, end, numbers[i]);
    if (problem != std::errc()) return std::nullopt;
    at = next;
  }
  if (at != end || !numbers.allFinite()) return std::nullopt;
  return numbers;
}

/// Turns by yaw, then pitch, then roll, each about the axis as it is by then.
Eigen::Quaterniond RotationOf(const Eigen::Vector3d& roll_pitch_yaw) {
  using Eigen::AngleAxisd;
  return AngleAxisd(roll_pitch_yaw.z(), Eigen::Vector3d::UnitZ()) *
         AngleAxisd(roll_pitch_yaw.y(), Eigen::Vector3d::UnitY()) *
         AngleAxisd(roll_pitch_yaw.x(), Eigen::Vector3d::UnitX());
}

/// The camera's z is the body's x, its x the body's y, its y the body's z.
Eigen::Quaterniond Forward() {
  Eigen::Matrix3d body_from_cam;
  body_from_cam << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return Eigen::Quaterniond(body_from_cam);
}

}  // namespace

Eigen::Quaterniond ParseMount(const std::string& text) {
  if (text == "forward") return Forward();
  if (text == "down") return RotationOf({0, -M_PI / 2, 0}) * Forward();
  const auto degrees = ThreeNumbers(text);
  if (!degrees || degrees->cwiseAbs().maxCoeff() > kMostDegrees) {
    throw Error(
        "mount is '{}': expected forward, down or ROLL,PITCH,YAW in degrees, as 0,-30,0 for a "
        "camera that looks 30 degrees down",
        text);
  }
  return RotationOf(kDegree * *degrees) * Forward();
}

Eigen::Vector3d ParseMountOffset(const std::string& text) {
  const auto metres = ThreeNumbers(text);
  if (!metres || metres->cwiseAbs().maxCoeff() > kMostOffset) {
    throw Error(
        "the place is '{}': expected X,Y,Z in metres forward, right and down of the "
        "autopilot, each within {} m",
        text, kMostOffset);
  }
  return *metres;
}

SE3 MountOfRosBody(const SE3& body_from_cam) {
  const Eigen::Quaterniond frd_from_flu(0, 1, 0, 0);  // Half a turn about x.
  return SE3(frd_from_flu, Eigen::Vector3d::Zero()) * body_from_cam;
}

}  // namespace deepuav
