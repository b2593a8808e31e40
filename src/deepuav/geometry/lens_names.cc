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
  return std::nullopt;
}

std::vector<std::string> LensModelNames() {
  std::vector<std::string> names;
  for (const NamedLens& known : kLenses) names.emplace_back(known.name);
  return names;
}

}  // namespace deepuav
