#pragma once

#include <string>

#include "deepuav/inference/session.h"
#include "deepuav/io/model_registry.h"

namespace deepuav {

/// The models that come with the program, or those of the folder that the environment variable
/// DEEPUAV_MODELS names. Read once. Throws Error for a folder without a
/// readable models.yaml.
const ModelRegistry& ShippedModels();

/// Which shipped SuperPoint finds the key points where features.model names no file.
struct NetworkSize {
  std::string size = "small";

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("size", size, "", "shipped SuperPoint network, where features.model is empty");
  }
};

/// The shipped network of that kind for the precision, where `file` is empty; else `file`. Throws
/// Error saying which there are.
std::string NetworkFile(const std::string& file, const std::string& kind, const std::string& size,
                        const InferenceOptions& inference);

/// A file that a command loads, and what for.
struct UsedModel {
  std::string use;  ///< "features", "matcher" or "vocabulary".
  CheckedModel model;
};

}  // namespace deepuav
