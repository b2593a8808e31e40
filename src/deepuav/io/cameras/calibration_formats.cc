#include "deepuav/io/cameras/calibration_formats.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/geometry/lens_names.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

constexpr size_t kMatrixValues = 9, kMostRadialTangential = 5;

/// Zeros behind k3, as of OpenCV's rational model that was not asked for, say nothing.
void DropZeros(std::vector<double>* coefficients) {
  while (coefficients->size() > kMostRadialTangential && coefficients->back() == 0)
    coefficients->pop_back();
}

LensModel LensNamed(const YamlMap& yaml, const std::string& name) {
  if (const auto lens = LensModelOf(name)) return *lens;
  throw Error("{}: {} is {}: expected one as {}", yaml.Where("distortion_model"),
              yaml.Name("distortion_model"), Quoted(name), fmt::join(LensModelNames(), ", "));
}

void SetDistortion(LensModel lens, std::vector<double> coefficients, const std::string& where,
                   const std::string& field, Camera* camera) {
  DropZeros(&coefficients);
  camera->lens = lens;
  const bool are_none = std::ranges::all_of(coefficients, [](double k) { return k == 0; });
  if (lens != LensModel::kPinhole || !are_none) camera->distortion = std::move(coefficients);
  CheckDistortionCount(lens, camera->distortion.size(), where, field);
}

void SetSize(const YamlMap& yaml, const char* width, const char* height, Camera* camera) {
  camera->width = yaml.Integer(width, 1, kMaxImageSidePx);
  camera->height = yaml.Integer(height, 1, kMaxImageSidePx);
}

bool IsSide(double side_px) {
  return side_px >= 1 && side_px <= kMaxImageSidePx && side_px == std::floor(side_px);
}

int Side(const YamlMap& yaml, double side_px) {
  if (IsSide(side_px)) return static_cast<int>(side_px);
  throw Error("{}: {} holds {}: expected whole numbers from 1 to {}", yaml.Where("resolution"),
              yaml.Name("resolution"), side_px, kMaxImageSidePx);
}

LensModel MatrixLens(const YamlMap& yaml) {
  if (yaml.Has("distortion_model")) return LensNamed(yaml, yaml.Text("distortion_model"));
  const bool is_fisheye = yaml.Has("fisheye_model") && yaml.Number("fisheye_model") != 0;
  return is_fisheye ? LensModel::kEquidistant : LensModel::kRadialTangential;
}

/// ROS's and OpenCV's.
Camera MatrixCamera(const YamlMap& yaml) {
  Camera camera;
  SetSize(yaml, "image_width", "image_height", &camera);
  const std::vector<double> k =
      yaml.Map("camera_matrix").Numbers("data", kMatrixValues, "9, by rows");
  camera.pinhole = {k[0], k[4], k[2], k[5]};
  const char* field = "distortion_coefficients";
  if (!yaml.Has(field)) return camera;
  const LensModel lens = MatrixLens(yaml);
  const YamlMap coefficients = yaml.Map(field);
  SetDistortion(lens, coefficients.Numbers("data"), coefficients.Where("data"),
                coefficients.Name("data"), &camera);
  return camera;
}

bool IsOrbSlamFisheye(const YamlMap& yaml) {
  if (!yaml.Has("Camera.type")) return false;
  const std::string type = yaml.Text("Camera.type");
  if (type == "KannalaBrandt8") return true;
  if (type == "PinHole" || type == "Rectified") return false;
  throw Error("{}: Camera.type is {}: expected PinHole, Rectified or KannalaBrandt8",
              yaml.Where("Camera.type"), Quoted(type));
}

/// ORB-SLAM2's and 3's. Coefficients that are not given are none.
Camera OrbSlamCamera(const YamlMap& yaml) {
  const std::string prefix = yaml.Has("Camera1.fx") ? "Camera1." : "Camera.";
  Camera camera;
  SetSize(yaml, "Camera.width", "Camera.height", &camera);
  camera.pinhole = {yaml.Number(prefix + "fx"), yaml.Number(prefix + "fy"),
                    yaml.Number(prefix + "cx"), yaml.Number(prefix + "cy")};
  if (yaml.Has("Camera.fps")) camera.rate_hz = std::max(0.0, yaml.Number("Camera.fps"));
  const bool is_fisheye = IsOrbSlamFisheye(yaml);
  std::vector<double> coefficients;
  for (const char* name :
       is_fisheye ? std::vector{"k1", "k2", "k3", "k4"} : std::vector{"k1", "k2", "p1", "p2", "k3"})
    coefficients.push_back(yaml.Has(prefix + name) ? yaml.Number(prefix + name) : 0);
  if (!is_fisheye && std::ranges::all_of(coefficients, [](double k) { return k == 0; }))
    return camera;
  SetDistortion(is_fisheye ? LensModel::kEquidistant : LensModel::kRadialTangential, coefficients,
                yaml.Where(prefix + "k1"), prefix + "k1", &camera);
  return camera;
}

/// Where COLMAP's parameters go: -1 is none. k1, k2 and what follows are put where the lens has
/// them.
struct ColmapModel {
  const char* name;
  LensModel lens;
  int fx, fy, cx, cy;
  std::vector<int> distortion;
  size_t count;
};

const std::vector<ColmapModel>& ColmapModels() {
  static const std::vector<ColmapModel> models = {
      {"SIMPLE_PINHOLE", LensModel::kPinhole, 0, 0, 1, 2, {}, 3},
      {"PINHOLE", LensModel::kPinhole, 0, 1, 2, 3, {}, 4},
      {"SIMPLE_RADIAL", LensModel::kRadialTangential, 0, 0, 1, 2, {3, -1, -1, -1}, 4},
      {"RADIAL", LensModel::kRadialTangential, 0, 0, 1, 2, {3, 4, -1, -1}, 5},
      {"OPENCV", LensModel::kRadialTangential, 0, 1, 2, 3, {4, 5, 6, 7}, 8},
      {"SIMPLE_RADIAL_FISHEYE", LensModel::kEquidistant, 0, 0, 1, 2, {3, -1, -1, -1}, 4},
      {"RADIAL_FISHEYE", LensModel::kEquidistant, 0, 0, 1, 2, {3, 4, -1, -1}, 5},
      {"OPENCV_FISHEYE", LensModel::kEquidistant, 0, 1, 2, 3, {4, 5, 6, 7}, 8},
  };
  return models;
}

const ColmapModel& ModelCalled(std::string_view name, const std::string& where) {
  std::vector<std::string> known;
  for (const ColmapModel& model : ColmapModels()) {
    if (name == model.name) return model;
    known.emplace_back(model.name);
  }
  throw Error("{}: the camera's model is {}: expected one of {}", where, Quoted(name),
              fmt::join(known, ", "));
}

int ColmapSide(std::string_view text, const std::string& where, const char* field) {
  const double side_px = ParseFinite(text, where, field);
  if (IsSide(side_px)) return static_cast<int>(side_px);
  throw Error("{}: {} is {}: expected a whole number from 1 to {}", where, field, side_px,
              kMaxImageSidePx);
}

Camera ColmapCamera(const std::vector<std::string_view>& fields, const std::string& where) {
  constexpr size_t kBeforeParameters = 4;
  constexpr double kCentreOfFirstPixel = 0.5;  // There; here it is 0.
  if (fields.size() < kBeforeParameters) {
    throw Error("{}: {} fields: expected a camera's number, model, width, height and parameters",
                where, fields.size());
  }
  const ColmapModel& model = ModelCalled(fields[1], where);
  if (fields.size() != kBeforeParameters + model.count) {
    throw Error("{}: {} has {} parameters: expected {}", where, model.name,
                fields.size() - kBeforeParameters, model.count);
  }
  const auto parameter = [&](int index) {
    return index < 0 ? 0
                     : ParseFinite(fields[kBeforeParameters + static_cast<size_t>(index)], where,
                                   "parameter");
  };
  Camera camera;
  camera.width = ColmapSide(fields[2], where, "width");
  camera.height = ColmapSide(fields[3], where, "height");
  camera.pinhole = {parameter(model.fx), parameter(model.fy),
                    parameter(model.cx) - kCentreOfFirstPixel,
                    parameter(model.cy) - kCentreOfFirstPixel};
  camera.lens = model.lens;
  for (const int index : model.distortion) camera.distortion.push_back(parameter(index));
  return camera;
}

}  // namespace

Camera KalibrCamera(const YamlMap& yaml) {
  const std::string model = yaml.Text("camera_model");
  if (model != "pinhole") {
    throw Error("{}: {} is {}: expected pinhole", yaml.Where("camera_model"),
                yaml.Name("camera_model"), Quoted(model));
  }
  Camera camera;
  const std::vector<double> size = yaml.Numbers("resolution", 2, "2 (width, height)");
  camera.width = Side(yaml, size[0]);
  camera.height = Side(yaml, size[1]);
  const std::vector<double> in = yaml.Numbers("intrinsics", 4, "4 (fu, fv, cu, cv)");
  camera.pinhole = {in[0], in[1], in[2], in[3]};
  camera.readout_s = ReadReadout(yaml);
  if (yaml.Has("rate_hz")) camera.rate_hz = std::max(0.0, yaml.Number("rate_hz"));
  const char* field =
      yaml.Has("distortion_coeffs") ? "distortion_coeffs" : "distortion_coefficients";
  if (!yaml.Has("distortion_model") && !yaml.Has(field)) return camera;
  const std::string name = yaml.Text("distortion_model");
  const LensModel lens = name == "none" ? LensModel::kPinhole : LensNamed(yaml, name);
  if (lens == LensModel::kPinhole && !yaml.Has(field)) return camera;
  SetDistortion(lens, yaml.Numbers(field), yaml.Where(field), yaml.Name(field), &camera);
  return camera;
}

std::optional<Camera> CameraOfOtherPrograms(const YamlMap& yaml) {
  if (yaml.Has("cam0")) return KalibrCamera(yaml.Map("cam0"));
  if (yaml.Has("intrinsics") && yaml.Has("resolution")) return KalibrCamera(yaml);
  if (yaml.Has("camera_matrix")) return MatrixCamera(yaml);
  if (yaml.Has("Camera.type") || yaml.Has("Camera.fx")) return OrbSlamCamera(yaml);
  return std::nullopt;
}

Camera ReadColmapCamera(const std::filesystem::path& file) {
  const TextFile text(file);
  if (text.lines().size() != 1) {
    throw Error("{}: lists {} cameras: expected one, as COLMAP's cameras.txt does", file.string(),
                text.lines().size());
  }
  const TextLine& line = text.lines().front();
  std::vector<std::string_view> fields;
  SplitAtBlanks(line.text, &fields);
  return ColmapCamera(fields, text.Where(line));
}

}  // namespace deepuav
