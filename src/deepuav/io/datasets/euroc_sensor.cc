#include "deepuav/io/datasets/euroc_sensor.h"

#include "deepuav/base/error.h"
#include "deepuav/io/cameras/calibration_formats.h"
#include "deepuav/io/files/yaml_map.h"
#include "deepuav/io/maps/rigid_matrix.h"

namespace deepuav {
namespace {

SE3 BodyFromSensor(const YamlMap& yaml) {
  const YamlMap matrix = yaml.Map("T_BS");
  const std::vector<double> data = matrix.Numbers("data", 16, "16, a 4x4 matrix by rows");
  const std::string where = matrix.Where("data");
  if (data[12] != 0 || data[13] != 0 || data[14] != 0 || data[15] != 1) {
    throw Error("{}: the last row of T_BS is {} {} {} {}: expected 0 0 0 1", where, data[12],
                data[13], data[14], data[15]);
  }
  return RigidFromRows(std::span<const double, 12>(data.data(), 12), where, "T_BS");
}

}  // namespace

SE3 ReadEurocBodyFromSensor(const std::filesystem::path& file) {
  return BodyFromSensor(YamlMap::Read(file));
}

EurocSensor ReadEurocSensor(const std::filesystem::path& file) {
  const YamlMap yaml = YamlMap::Read(file);
  yaml.Text("distortion_model");  // Kalibr leaves it out of a pinhole's.
  EurocSensor sensor{KalibrCamera(yaml), BodyFromSensor(yaml)};
  const double rate_hz = yaml.Number("rate_hz");
  if (rate_hz <= 0) {
    throw Error("{}: rate_hz is {}: expected more than 0", yaml.Where("rate_hz"), rate_hz);
  }
  sensor.camera.Check(file.string());
  return sensor;
}

}  // namespace deepuav
