#include "deepuav/io/datasets/euroc_sensor.h"

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/files/yaml_map.h"
#include "deepuav/io/maps/rigid_matrix.h"

namespace deepuav {
namespace {

std::vector<double> ReadCounted(const YamlMap& yaml, const std::string& key, size_t count,
                                const char* expected) {
  std::vector<double> numbers = yaml.Numbers(key);
  if (numbers.size() != count) {
    throw Error("{}: {} holds {} numbers: expected {}", yaml.Where(key), yaml.Name(key),
                numbers.size(), expected);
  }
  return numbers;
}

SE3 BodyFromSensor(const YamlMap& yaml) {
  const YamlMap matrix = yaml.Map("T_BS");
  const std::vector<double> data = ReadCounted(matrix, "data", 16, "16, a 4x4 matrix by rows");
  const std::string where = matrix.Where("data");
  if (data[12] != 0 || data[13] != 0 || data[14] != 0 || data[15] != 1) {
    throw Error("{}: the last row of T_BS is {} {} {} {}: expected 0 0 0 1", where, data[12],
                data[13], data[14], data[15]);
  }
  return RigidFromRows(std::span<const double, 12>(data.data(), 12), where, "T_BS");
}

int ReadSide(const YamlMap& yaml, double side) {
  if (side != static_cast<int>(std::clamp(side, 1.0, double{kMaxImageSidePx}))) {
    throw Error("{}: resolution holds {}: expected whole numbers from 1 to {}",
                yaml.Where("resolution"), side, kMaxImageSidePx);
  }
  return static_cast<int>(side);
}

LensModel ReadLens(const YamlMap& yaml) {
  const std::string model = yaml.Text("distortion_model");
  if (model == "radial-tangential" || model == "radtan") return LensModel::kRadialTangential;
  if (model == "equidistant") return LensModel::kEquidistant;
  throw Error("{}: distortion_model is {}: expected radial-tangential, radtan or equidistant",
              yaml.Where("distortion_model"), Quoted(model));
}

}  // namespace

SE3 ReadEurocBodyFromSensor(const std::filesystem::path& file) {
  return BodyFromSensor(YamlMap::Read(file));
}

EurocSensor ReadEurocSensor(const std::filesystem::path& file) {
  const YamlMap yaml = YamlMap::Read(file);
  const std::string model = yaml.Text("camera_model");
  if (model != "pinhole") {
    throw Error("{}: camera_model is {}: expected pinhole", yaml.Where("camera_model"),
                Quoted(model));
  }
  EurocSensor sensor;
  sensor.body_from_cam = BodyFromSensor(yaml);
  const std::vector<double> resolution = ReadCounted(yaml, "resolution", 2, "2 (width, height)");
  sensor.camera.width = ReadSide(yaml, resolution[0]);
  sensor.camera.height = ReadSide(yaml, resolution[1]);
  const std::vector<double> intrinsics = ReadCounted(yaml, "intrinsics", 4, "4 (fu, fv, cu, cv)");
  sensor.camera.pinhole = {intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]};
  sensor.camera.lens = ReadLens(yaml);
  sensor.camera.distortion = yaml.Numbers("distortion_coefficients");
  CheckDistortionCount(sensor.camera.lens, sensor.camera.distortion.size(),
                       yaml.Where("distortion_coefficients"), "distortion_coefficients");
  sensor.camera.rate_hz = yaml.Number("rate_hz");
  if (sensor.camera.rate_hz <= 0) {
    throw Error("{}: rate_hz is {}: expected more than 0", yaml.Where("rate_hz"),
                sensor.camera.rate_hz);
  }
  sensor.camera.readout_s = ReadReadout(yaml);
  sensor.camera.Check(file.string());
  return sensor;
}

}  // namespace deepuav
