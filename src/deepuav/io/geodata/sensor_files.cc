#include "deepuav/io/geodata/sensor_files.h"

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/datasets/euroc_sensor.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/files/yaml_map.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/geodata/gpmf_file.h"
#include "deepuav/io/geodata/srt_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

/// Of a receiver that is wired to the camera's computer, and of one that is not: photographs often
/// have whole seconds.
constexpr double kWiredClockSigma_s = 0.05, kSubtitleClockSigma_s = 0.3, kOwnClockSigma_s = 1;

/// Calls take(time, numbers, where) for each line of so many numbers behind a time in nanoseconds,
/// which must grow.
template <typename Take>
void VisitSamples(const fs::path& file, size_t numbers, const Take& take) {
  const TextFile text(file);
  std::vector<std::string_view> fields;
  std::optional<Timestamp> last;
  for (const TextLine& line : text.lines()) {
    const std::string where = text.Where(line);
    SplitAtCommas(line.text, &fields);
    if (fields.size() != numbers + 1) {
      throw Error("{}: {} fields: expected {}, a time in nanoseconds first", where, fields.size(),
                  numbers + 1);
    }
    const Timestamp time = ParseNanoseconds(fields[0], where);
    if (last && !(*last < time)) {
      throw Error("{}: time stamp {} ns does not come after the one before: expected growing times",
                  where, time.nanoseconds);
    }
    last = time;
    std::vector<double> values;
    for (size_t i = 1; i < fields.size(); ++i)
      values.push_back(ParseFinite(fields[i], where, "measurement"));
    take(time, values);
  }
}

SE3 BodyFromSensor(const fs::path& folder) {
  const fs::path file = folder / "sensor.yaml";
  return fs::exists(file) ? ReadEurocBodyFromSensor(file) : SE3();
}

}  // namespace

ImuNoise ReadImuNoise(const fs::path& file) {
  if (!fs::exists(file)) return {};
  const YamlMap yaml = YamlMap::Read(file);
  const auto number = [&](const char* key) { return yaml.Has(key) ? yaml.Number(key) : 0; };
  return {number("gyroscope_noise_density"), number("gyroscope_random_walk"),
          number("accelerometer_noise_density"), number("accelerometer_random_walk")};
}

std::vector<ImuSample> ReadImuFile(const fs::path& file) {
  std::vector<ImuSample> samples;
  VisitSamples(file, 6, [&](Timestamp time, const std::vector<double>& values) {
    samples.push_back(
        {time, Eigen::Vector3d::Map(values.data()), Eigen::Vector3d::Map(values.data() + 3)});
  });
  return samples;
}

std::vector<BarometerSample> ReadBarometerFile(const fs::path& file) {
  std::vector<BarometerSample> samples;
  VisitSamples(file, 2, [&](Timestamp time, const std::vector<double>& values) {
    samples.push_back({time, values[0], values[1]});
  });
  return samples;
}

SensorStreams ReadEurocSensors(const fs::path& mav0, const std::optional<SE3>& body_from_cam) {
  const SE3 cam_from_body = body_from_cam ? body_from_cam->Inverse() : SE3();
  SensorStreams streams;
  if (const fs::path file = mav0 / "imu0" / "data.csv"; fs::exists(file)) {
    streams.imu = {file.string(), ReadImuNoise(mav0 / "imu0" / "sensor.yaml"),
                   cam_from_body * BodyFromSensor(mav0 / "imu0"), ReadImuFile(file)};
  }
  if (const fs::path file = mav0 / "gps0" / "data.csv"; fs::exists(file)) {
    streams.gnss = {file.string(), cam_from_body * BodyFromSensor(mav0 / "gps0").translation(),
                    kWiredClockSigma_s, ReadGnssFile(file)};
  }
  if (const fs::path file = mav0 / "baro0" / "data.csv"; fs::exists(file)) {
    streams.barometer = {file.string(),
                         cam_from_body * BodyFromSensor(mav0 / "baro0").translation(),
                         ReadBarometerFile(file)};
  }
  return streams;
}

SensorStreams ReadSensorsBesideVideo(const fs::path& video) {
  SensorStreams streams;
  if (std::vector<ImuSample> samples = ReadGpmfImu(video); !samples.empty()) {
    streams.imu.source = "GPMF track of " + video.string();
    streams.imu.samples = std::move(samples);
    streams.imu.mount_is_known = false;
  }
  for (const char* ending : {".SRT", ".srt"}) {
    const fs::path file = fs::path(video).replace_extension(ending);
    if (!fs::is_regular_file(file)) continue;
    streams.gnss = {.source = file.string(),
                    .clock_sigma_s = kSubtitleClockSigma_s,
                    .fixes = ReadSrtFile(file)};
    return streams;
  }
  streams.gnss = ReadGnssBeside({video.parent_path()}, video.stem().string());
  if (streams.gnss.fixes.empty()) {
    streams.gnss = {.source = "GPMF track of " + video.string(),
                    .clock_sigma_s = kSubtitleClockSigma_s,
                    .fixes = ReadGpmfFixes(video)};
    return streams;
  }
  const Timestamp start = streams.gnss.fixes.front().time;
  for (GnssFix& fix : streams.gnss.fixes) fix.time.nanoseconds -= start.nanoseconds;
  return streams;
}

fs::path FindGnssBeside(const std::vector<fs::path>& folders, const std::string& name) {
  for (const fs::path& folder : folders) {
    for (const char* ending : {".csv", ".CSV", ".gpx", ".GPX"}) {
      const fs::path file = folder / (name + ending);
      if (!fs::is_regular_file(file)) continue;
      if (IsGnssFile(file)) return file;
      Log().warn(
          "{}: not used: expected position fixes, with a head that names columns of time, latitude "
          "and longitude",
          file.string());
    }
  }
  return {};
}

GnssStream ReadGnssBeside(const std::vector<fs::path>& folders, const std::string& name) {
  const fs::path file = FindGnssBeside(folders, name);
  if (file.empty()) return {};
  return {.source = file.string(), .clock_sigma_s = kOwnClockSigma_s, .fixes = ReadGnssFile(file)};
}

}  // namespace deepuav
