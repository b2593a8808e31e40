#include "deepuav/assembly/settings/shipped_models.h"

#include <cstdlib>

#include "deepuav/assembly/settings/shipped_files.h"
#include "deepuav/inference/cpu_arithmetic.h"

namespace deepuav {

const ModelRegistry& ShippedModels() {
  const char* named = std::getenv("DEEPUAV_MODELS");
  static const ModelRegistry registry(named && *named ? named : ShippedFolder("models"));
  return registry;
}

std::string NetworkFile(const std::string& file, const std::string& kind, const std::string& size,
                        const InferenceOptions& inference) {
  if (!file.empty()) return file;
  return ShippedModels()
      .Network(kind, size, inference.precision, HasFastArithmetic("int8"))
      .file.string();
}

}  // namespace deepuav
