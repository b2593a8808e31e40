#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "deepuav/api/export.h"

/// What other programs see of Deep-UAV SLAM: plain values, C++17, the same under all flags of a
/// compiler with libstdc++ but those that change its own types, of which std::string, std::vector
/// and the like are used: _GLIBCXX_DEBUG and _GLIBCXX_USE_CXX11_ABI=0. Lengths are metres where a
/// map is metric or georeferenced, else the map's own unit; angles are radians, times nanoseconds
/// of one clock. Pixel (0, 0) is the centre of the top-left pixel. A transform a_from_b maps points
/// of b into a; a camera looks along z, x right, y down.
namespace deepuav::api {

/// The only exception that leaves the library. The message is one line that says what was found and
/// what was expected.
class DEEPUAV_API Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message);
  Error(const Error& other);
  ~Error() override;
};

struct Vector3 {
  double x = 0, y = 0, z = 0;
};

/// A rotation: of unit length.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;
};

struct Pose {
  Quaternion rotation;
  Vector3 translation;
};

enum class LensModel {
  kPinhole,           ///< No distortion.
  kRadialTangential,  ///< k1 k2 p1 p2 [k3]
  kEquidistant,       ///< k1 k2 k3 k4: fisheye.
};

/// A calibrated camera. Pixels.
struct Camera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  LensModel lens = LensModel::kPinhole;
  std::vector<double> distortion;
  double rate_hz = 0;    ///< Nominal; 0: not known.
  double readout_s = 0;  ///< Of a rolling shutter, first row to last; an image's time is the middle
                         ///< row's. 0: all rows at once.
};

/// Reads a camera.yaml, or a camera's sensor.yaml of EuRoC. Throws Error naming file and field.
DEEPUAV_API Camera ReadCamera(const std::string& file);

enum class PixelFormat {
  kGrey8,  ///< One byte a pixel.
  kBgr8,   ///< Three, as of OpenCV.
  kRgb8,
};

/// Pixels that belong to someone else; they are read, at most copied, during a call only.
struct ImageView {
  const std::uint8_t* pixels = nullptr;
  int width = 0, height = 0;
  std::ptrdiff_t stride_bytes = 0;  ///< From row to row; 0: rows follow one another.
  PixelFormat format = PixelFormat::kGrey8;
};

struct ImuSample {
  std::int64_t time_ns = 0;
  Vector3 angular_velocity_rad_s;
  Vector3 specific_force_m_s2;  ///< Acceleration less gravity.
};

struct GnssFix {
  std::int64_t time_ns = 0;
  double latitude_deg = 0, longitude_deg = 0;  ///< WGS 84.
  std::optional<double> altitude_m;            ///< Above the ellipsoid or the sea.
  Vector3 sigma_m;                             ///< East, north, up; 0: not stated.
};

struct BarometerSample {
  std::int64_t time_ns = 0;
  double altitude_m = 0;  ///< Of the pressure in the standard atmosphere.
};

struct TimedPose {
  std::int64_t time_ns = 0;
  Pose world_from_camera;
};

/// What became of an image.
enum class FrameState {
  kTracked,       ///< Had its pose when its turn came.
  kLocated,       ///< Has one since the end of the run.
  kReckoned,      ///< The same, by the inertial sensor alone.
  kInferred,      ///< The same: the most probable one between the frames about it.
  kInitialising,  ///< Has none: no map was started yet...
  kLost,          ///< ...or it was not found in one.
};

struct Frame {
  std::int64_t id = 0;  ///< 0, 1, ... in the order of the images, those left out included.
  std::int64_t time_ns = 0;
  FrameState state = FrameState::kInitialising;
  std::string reason;  ///< Why there was no pose when its turn came.
  int map = -1;        ///< Among Maps(); -1: no pose.
  Pose world_from_camera;
  int keypoints = 0;  ///< Found in the image.
  int landmarks = 0;  ///< That spoke for the pose.
};

struct Keyframe {
  std::int64_t id = 0;
  std::int64_t time_ns = 0;
  int map = -1;
  Pose world_from_camera;
  std::string image;  ///< The file's name, where it has one.
};

struct Landmark {
  std::int64_t id = 0;
  int map = -1;
  Vector3 position_world;
  int observations = 0;  ///< Keyframes that see it.
};

enum class GaugeKind {
  kFree,           ///< Of the camera alone: place, heading and scale are arbitrary.
  kMetric,         ///< Metres, z up.
  kGeoreferenced,  ///< Metres east, north and up of an origin on Earth.
};

struct MapInfo {
  int id = -1;  ///< As in Frame, Keyframe, Landmark and the files that are written.
  int keyframes = 0, landmarks = 0;
  GaugeKind gauge = GaugeKind::kFree;
  double scale_sigma = 0;  ///< Standard deviation of the scale, as a share of it.
  double origin_latitude_deg = 0, origin_longitude_deg = 0, origin_altitude_m = 0;
};

}  // namespace deepuav::api
