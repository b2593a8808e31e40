#include "deepuav/io/geodata/geo_trajectory.h"

#include <fmt/chrono.h>

#include <ctime>
#include <string>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

constexpr int64_t kNanosecondsPerSecond = 1000000000;

std::vector<GeoPoint> PointsOf(const std::filesystem::path& file, const GeoPoint& origin,
                               const Trajectory& path) {
  std::vector<GeoPoint> points;
  points.reserve(path.size());
  for (const TimedPose& pose : path) {
    const Eigen::Vector3d& position_m = pose.world_from_cam.translation();
    if (!position_m.allFinite())
      throw Error("{}: the pose at {:.9f} s is not finite", file.string(), pose.time.seconds());
    points.push_back(GeoFromLocal(origin, position_m));
  }
  return points;
}

/// ISO 8601 with nanoseconds, UTC.
std::string IsoTime(Timestamp time) {
  int64_t seconds = time.nanoseconds / kNanosecondsPerSecond;
  int64_t rest = time.nanoseconds % kNanosecondsPerSecond;
  if (rest < 0) {
    rest += kNanosecondsPerSecond;
    --seconds;
  }
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:09}Z", fmt::gmtime(static_cast<std::time_t>(seconds)),
                     rest);
}

}  // namespace

void WriteGeoJson(const std::filesystem::path& file, const GeoPoint& origin,
                  const Trajectory& path) {
  std::string coordinates, times;
  const std::vector<GeoPoint> points = PointsOf(file, origin, path);
  for (size_t i = 0; i < points.size(); ++i) {
    const char* comma = i == 0 ? "" : ",\n    ";
    coordinates += fmt::format("{}[{:.9f}, {:.9f}, {:.4f}]", comma, points[i].longitude_deg,
                               points[i].latitude_deg, points[i].altitude_m);
    times += fmt::format("{}\"{}\"", comma, IsoTime(path[i].time));
  }
  WriteFileAtomically(
      file, fmt::format("{{\"type\": \"Feature\",\n \"geometry\": {{\"type\": \"LineString\", "
                        "\"coordinates\": [\n    {}]}},\n \"properties\": {{\"times\": [\n    "
                        "{}]}}}}\n",
                        coordinates, times));
}

void WriteKml(const std::filesystem::path& file, const GeoPoint& origin, const Trajectory& path) {
  std::string coordinates;
  for (const GeoPoint& point : PointsOf(file, origin, path)) {
    coordinates += fmt::format("{:.9f},{:.9f},{:.4f}\n", point.longitude_deg, point.latitude_deg,
                               point.altitude_m);
  }
  WriteFileAtomically(
      file, fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                        "<kml xmlns=\"http://www.opengis.net/kml/2.2\">\n<Placemark>\n"
                        "<name>Camera</name>\n<LineString>\n"
                        "<altitudeMode>absolute</altitudeMode>\n<coordinates>\n{}</coordinates>\n"
                        "</LineString>\n</Placemark>\n</kml>\n",
                        coordinates));
}

void WriteGpx(const std::filesystem::path& file, const GeoPoint& origin, const Trajectory& path) {
  std::string track;
  const std::vector<GeoPoint> points = PointsOf(file, origin, path);
  for (size_t i = 0; i < points.size(); ++i) {
    track += fmt::format(
        "<trkpt lat=\"{:.9f}\" lon=\"{:.9f}\"><ele>{:.4f}</ele><time>{}</time></trkpt>\n",
        points[i].latitude_deg, points[i].longitude_deg, points[i].altitude_m,
        IsoTime(path[i].time));
  }
  WriteFileAtomically(file, fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                                        "<gpx version=\"1.1\" creator=\"Deep-UAV SLAM\" "
                                        "xmlns=\"http://www.topografix.com/GPX/1/1\">\n"
                                        "<trk><trkseg>\n{}</trkseg></trk>\n</gpx>\n",
                                        track));
}

}  // namespace deepuav
