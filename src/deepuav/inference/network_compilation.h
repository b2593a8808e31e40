#pragma once

#include <filesystem>
#include <memory>
#include <openvino/openvino.hpp>
#include <set>
#include <string>
#include <vector>

#include "deepuav/inference/session.h"

namespace deepuav {

/// The precision, "fp32" or "bf16", of the layers that are not quantised, for one that
/// InferenceOptions name.
std::string FloatPrecision(const std::string& precision, bool is_quantised);

/// A network before it is compiled, its shapes fixed.
struct NetworkSource {
  std::filesystem::path path;
  std::string sha256;  ///< Of the file.
  std::shared_ptr<ov::Model> model;
  std::vector<TensorInfo> inputs;
  std::set<std::string> channels_last;  ///< As of Session::Compile.
};

/// A network as it runs.
struct CompiledNetwork {
  ov::CompiledModel compiled;
  std::string float_precision;  ///< As of FloatPrecision: of what is compiled or, before, wanted.
  bool from_cache = false;
};

/// Compiles the network in its float precision, or takes it from the options' cache. Where the CPU
/// computes wrongly in bf16 it is fp32 then. Throws what the runtime throws.
void CompileOrLoad(const NetworkSource& source, const InferenceOptions& options,
                   CompiledNetwork* network);

/// What the runtime granted in place of the network's float precision, if it did.
void NoteGrantedPrecision(const std::filesystem::path& path, CompiledNetwork* network);

}  // namespace deepuav
