#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/inference/cpu_arithmetic.h"

namespace deepuav {

struct InferenceOptions {
  int threads = 2;
  std::string precision = "auto";
  std::string cache_dir;

  void Check() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("threads", threads, "", "CPU threads of one network", Between(1, 1024));
    visit(
        "precision", precision, "",
        "arithmetic: auto (int8 for quantised networks and bf16 for others, where the CPU has it), "
        "fp32, bf16 or int8 (quantised networks)",
        Precisions());
    visit("cache_dir", cache_dir, "", "folder for compiled networks; empty: none are kept");
  }
};

/// Sizes of a tensor's dimensions, outermost first.
using TensorShape = std::vector<int64_t>;

/// The size of a dimension that the model leaves open.
inline constexpr int64_t kAnySize = -1;

/// "[1,256,?,94]"
std::string ShapeText(const TensorShape& shape);

/// An input or output of a network.
struct TensorInfo {
  std::string name;
  std::string element_type;  ///< In the model's file; a session converts from and to float.
  TensorShape shape;
};

/// SHA-256 of the model: of the file, for OpenVINO's .xml of graph and weights (.bin), one after
/// the other.
std::string ModelSha256(const std::filesystem::path& model);

/// A network on the CPU. The same model, shapes and options give the same bytes on one machine. Not
/// thread-safe.
class Session {
 public:
  /// Reads an ONNX file or an OpenVINO .xml with its .bin. Throws Error naming the file when it is
  /// missing or no model, and for the precision int8 when it is not quantised. A quantised network
  /// has int8 layers under every precision, which then is that of its other layers: fp32 but where
  /// bf16 is asked for.
  Session(std::filesystem::path model, const InferenceOptions& options);
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  const std::filesystem::path& model() const;
  /// As in the file until Reshape, then with the shapes that follow from the inputs'.
  const std::vector<TensorInfo>& inputs() const;
  const std::vector<TensorInfo>& outputs() const;

  /// Fixes the shape of every input. Throws Error when an input is missing or unknown, or cannot
  /// have the shape.
  void Reshape(const std::map<std::string, TensorShape>& input_shapes);

  /// Makes the network ready to run; the shapes must be fixed. The four-dimensional outputs named
  /// in `channels_last` are given as [N,H,W,C] instead of the model's [N,C,H,W]: the runtime often
  /// computes in that order anyway.
  void Compile(const std::set<std::string>& channels_last = {});

  /// Refers to `values`, which must stay in place while Run is called. Throws Error for an unknown
  /// name or another number of elements than the compiled shape has.
  void SetInput(const std::string& name, std::span<const float> values);

  /// Throws Error when an input was never set, or the runtime fails.
  void Run();

  /// Valid until the next Run. Throws Error for an unknown name.
  std::span<const float> Output(const std::string& name) const;
  /// The shape of the last run's output.
  TensorShape OutputShape(const std::string& name) const;

  /// "fp32" or "bf16", after "auto" is resolved and, once compiled, as the runtime granted it and
  /// computes it rightly; of a quantised network "int8+fp32" or "int8+bf16".
  const std::string& precision() const;
  const std::string& sha256() const;  ///< ModelSha256 of the model.
  int threads() const;                ///< Granted by the runtime; after Compile.
  bool from_cache() const;            ///< Whether Compile found the compiled network in the cache.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace deepuav
