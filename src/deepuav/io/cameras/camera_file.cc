#include "deepuav/io/cameras/camera_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "deepuav/base/error.h"
#include "deepuav/base/nearest_name.h"
#include "deepuav/geometry/lens_names.h"
#include "deepuav/io/cameras/calibration_formats.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/files/yaml_map.h"

namespace deepuav {
namespace {

constexpr const char* kReadoutField = "readout_ms";
constexpr const char* kAuto = "auto";  // A model to be found.
constexpr double kMaxReadoutMs = 1000;

const std::array<std::string, 10> kFields = {
    "model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "rate_hz", kReadoutField};
const std::array<std::string, 6> kIntrinsics = {"width", "height", "fx", "fy", "cx", "cy"};

std::string ReadModel(const YamlMap& yaml) {
  std::string model = yaml.Text("model");
  if (model == kAuto || LensModelOf(model)) return model;
  std::vector<std::string> known = LensModelNames();
  const std::string named = fmt::format("{}", fmt::join(known, ", "));
  known.emplace_back(kAuto);
  throw Error("{}: model is {}: expected {} or {} (the nearest is '{}')", yaml.Where("model"),
              Quoted(model), named, kAuto, NearestName(model, known));
}

LensModel LensOf(const std::string& model, bool distorted) {
  if (const auto lens = LensModelOf(model)) return *lens;
  return distorted ? LensModel::kRadialTangential : LensModel::kPinhole;
}

void ReadIntrinsics(const YamlMap& yaml, const std::string& model, Camera* camera) {
  camera->width = yaml.Integer("width", 1, kMaxImageSidePx);
  camera->height = yaml.Integer("height", 1, kMaxImageSidePx);
  camera->pinhole = {yaml.Number("fx"), yaml.Number("fy"), yaml.Number("cx"), yaml.Number("cy")};
  const bool may_lack_distortion = LensModelOf(model) == LensModel::kPinhole || model == kAuto;
  if (yaml.Has("distortion") || !may_lack_distortion)
    camera->distortion = yaml.Numbers("distortion");
  camera->lens = LensOf(model, !camera->distortion.empty());
  CheckDistortionCount(camera->lens, camera->distortion.size(), yaml.Where("distortion"),
                       "distortion");
}

CameraFile Known(const Camera& camera, const std::filesystem::path& file) {
  camera.Check(file.string());
  return {.camera = camera};
}

}  // namespace

void CheckDistortionCount(LensModel lens, size_t count, const std::string& where,
                          const std::string& field) {
  const auto require = [&](bool holds, const char* expected) {
    if (!holds)
      throw Error("{}: {} holds {} coefficients: expected {}", where, field, count, expected);
  };
  switch (lens) {
    case LensModel::kPinhole:
      return require(count == 0, "none for a pinhole (radial_tangential has some)");
    case LensModel::kRadialTangential:
      return require(count == 4 || count == 5, "4 or 5 (k1 k2 p1 p2 [k3])");
    case LensModel::kEquidistant:
      return require(count == 4, "4 (k1 k2 k3 k4)");
  }
}

double ReadReadout(const YamlMap& yaml) {
  if (!yaml.Has(kReadoutField)) return 0;
  const double readout_ms = yaml.Number(kReadoutField);
  if (!(readout_ms >= 0 && readout_ms <= kMaxReadoutMs)) {
    throw Error("{}: {} is {}: expected 0 to {}", yaml.Where(kReadoutField), kReadoutField,
                readout_ms, kMaxReadoutMs);
  }
  return readout_ms / 1000;
}

CameraFile ReadCameraFile(const std::filesystem::path& file) {
  if (file.filename() == "cameras.txt") return Known(ReadColmapCamera(file), file);
  const YamlMap yaml = YamlMap::Read(file);
  if (const auto camera = CameraOfOtherPrograms(yaml)) return Known(*camera, file);
  yaml.RequireKnown(kFields);
  const std::string model = ReadModel(yaml);
  CameraFile result;
  result.refine = model == kAuto;
  const bool any_given = std::any_of(kIntrinsics.begin(), kIntrinsics.end(),
                                     [&](const auto& key) { return yaml.Has(key); });
  result.has_intrinsics = !result.refine || any_given;
  if (yaml.Has("rate_hz")) {
    result.camera.rate_hz = yaml.Number("rate_hz");
    if (result.camera.rate_hz <= 0) {
      throw Error("{}: rate_hz is {}: expected more than 0", yaml.Where("rate_hz"),
                  result.camera.rate_hz);
    }
  }
  result.camera.readout_s = ReadReadout(yaml);
  if (!result.has_intrinsics) {
    if (yaml.Has("distortion")) {
      throw Error(
          "{}: distortion is given without width, height, fx, fy, cx and cy: expected all or none",
          yaml.Where("distortion"));
    }
    return result;
  }
  ReadIntrinsics(yaml, model, &result.camera);
  result.camera.Check(file.string());
  return result;
}

CameraFile ReadCompleteCameraFile(const std::filesystem::path& file) {
  CameraFile result = ReadCameraFile(file);
  if (!result.has_intrinsics) {
    throw Error(
        "{}: model is 'auto' without intrinsics, and there is no EXIF: expected width, height, fx, "
        "fy, cx, cy",
        file.string());
  }
  return result;
}

}  // namespace deepuav
