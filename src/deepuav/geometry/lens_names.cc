#include "deepuav/geometry/lens_names.h"

#include <cassert>

namespace deepuav {
namespace {

struct NamedLens {
  LensModel lens;
  const char* name;
};

constexpr NamedLens kLenses[] = {{LensModel::kPinhole, "pinhole"},
                                 {LensModel::kRadialTangential, "radial_tangential"},
                                 {LensModel::kEquidistant, "equidistant"}};

/// As Kalibr, EuRoC, ROS, OpenCV, COLMAP and ORB-SLAM3 call them.
constexpr NamedLens kOtherNames[] = {{LensModel::kRadialTangential, "radial-tangential"},
                                     {LensModel::kRadialTangential, "radtan"},
                                     {LensModel::kRadialTangential, "plumb_bob"},
                                     {LensModel::kRadialTangential, "brown_conrady"},
                                     {LensModel::kRadialTangential, "opencv"},
                                     {LensModel::kEquidistant, "fisheye"},
                                     {LensModel::kEquidistant, "kannala_brandt"},
                                     {LensModel::kEquidistant, "KannalaBrandt8"},
                                     {LensModel::kEquidistant, "opencv_fisheye"},
                                     {LensModel::kPinhole, "PinHole"}};

}  // namespace

std::string NameOf(LensModel lens) {
  for (const NamedLens& known : kLenses) {
    if (known.lens == lens) return known.name;
  }
  assert(false);
  return {};
}

std::optional<LensModel> LensModelOf(std::string_view name) {
  for (const NamedLens& known : kLenses) {
    if (known.name == name) return known.lens;
  }
  for (const NamedLens& known : kOtherNames) {
    if (known.name == name) return known.lens;
  }
  return std::nullopt;
}

std::vector<std::string> LensModelNames() {
  std::vector<std::string> names;
  for (const NamedLens& known : kLenses) names.emplace_back(known.name);
  return names;
}

}  // namespace deepuav
