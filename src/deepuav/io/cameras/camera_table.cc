#include "deepuav/io/cameras/camera_table.h"

#include <algorithm>
#include <string>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

/// As RFC 4180 has it.
std::string Field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) {
    if (letter == '"') quoted += '"';
    quoted += letter;
  }
  return quoted + '"';
}

std::vector<const Keyframe*> ByTime(const Map& map) {
  std::vector<const Keyframe*> keyframes;
  map.keyframes().ForEach([&](const Keyframe& keyframe) { keyframes.push_back(&keyframe); });
  std::stable_sort(keyframes.begin(), keyframes.end(), [](const Keyframe* a, const Keyframe* b) {
    return a->frame.time < b->frame.time;
  });
  return keyframes;
}

}  // namespace

void WriteCameraTable(const std::filesystem::path& file, const Map& map,
                      const ImageNames& image_names, const std::optional<GeoPoint>& origin) {
  std::string csv = "image,time_ns,x,y,z,qx,qy,qz,qw,latitude_deg,longitude_deg,altitude_m\n";
  for (const Keyframe* keyframe : ByTime(map)) {
    const SE3 world_from_cam = keyframe->cam_from_world.Inverse();
    const Eigen::Vector3d& p = world_from_cam.translation();
    const Eigen::Quaterniond& q = world_from_cam.rotation();
    if (!p.allFinite())
      throw Error("{}: keyframe {} has no finite position", file.string(), keyframe->id.value);
    const auto name = image_names.find(keyframe->id);
    csv += fmt::format("{},{},{:.6f},{:.6f},{:.6f},{:.9f},{:.9f},{:.9f},{:.9f}",
                       Field(name == image_names.end() ? "" : name->second),
                       keyframe->frame.time.nanoseconds, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(),
                       q.w());
    if (origin) {
      const GeoPoint geo = GeoFromLocal(*origin, p);
      csv += fmt::format(",{:.9f},{:.9f},{:.4f}\n", geo.latitude_deg, geo.longitude_deg,
                         geo.altitude_m);
    } else {
      csv += ",,,\n";
    }
  }
  WriteFileAtomically(file, csv);
}

}  // namespace deepuav
