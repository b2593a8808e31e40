#include "deepuav/inference/network_compilation.h"

#include <fmt/format.h>

#include <sstream>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/inference/blob_cache.h"
#include "deepuav/inference/cpu_arithmetic.h"
#include "deepuav/inference/network_file.h"
#include "deepuav/inference/precision_check.h"

namespace deepuav {
namespace {

constexpr char kDevice[] = "CPU";

/// What bf16 may change in an output, as RelativeDifference measures it. Rounding changes 0.02.
constexpr double kMaxBf16Difference = 0.1;

ov::AnyMap Config(int threads, const std::string& float_precision) {
  // Pinned threads of two networks that run at the same time would share cores while others are
  // idle, and without hyper-threads the runtime grants fewer threads than asked for.
  return {ov::inference_num_threads(threads),
          ov::num_streams(1),
          ov::hint::performance_mode(ov::hint::PerformanceMode::LATENCY),
          ov::hint::inference_precision(float_precision == "bf16" ? ov::element::bf16
                                                                  : ov::element::f32),
          ov::hint::enable_cpu_pinning(false),
          ov::hint::enable_hyper_threading(true)};
}

ov::CompiledModel CompileModel(const NetworkSource& source, int threads,
                               const std::string& float_precision) {
  return Core().compile_model(source.model, kDevice, Config(threads, float_precision));
}

/// All that the compiled network depends on.
std::string CacheKey(const NetworkSource& source, int threads, const std::string& float_precision) {
  const std::string checked = float_precision == "bf16" ? "checked " : "";
  std::string key =
      fmt::format("{} {} {}{} {} {} {}", source.sha256, WeightsSha256(*source.model), checked,
                  float_precision, threads, ov::get_openvino_version().buildNumber,
                  Core().get_property(kDevice, ov::device::full_name));
  for (const auto& capability : Core().get_property(kDevice, ov::device::capabilities))
    key += " " + capability;
  for (const TensorInfo& input : source.inputs) key += " " + input.name + ShapeText(input.shape);
  for (const auto& name : source.channels_last) key += " " + name;
  return key;
}

bool Load(const BlobCache& cache, const NetworkSource& source, int threads,
          CompiledNetwork* network) {
  const auto blob = cache.Load(CacheKey(source, threads, network->float_precision));
  if (!blob) return false;
  try {
    std::istringstream stream(*blob);
    network->compiled =
        Core().import_model(stream, kDevice, Config(threads, network->float_precision));
    return true;
  } catch (const std::exception& exception) {
    Log().warn("{}: the compiled network in the cache is not used: {}", source.path.string(),
               LastLine(exception.what()));
    return false;
  }
}

/// OpenVINO 2026.4 computes some convolutions wrongly by AMX in bf16 (kernels of 4 pixels at steps
/// of 4 over 16 channels, for one), silently. So bf16 must give what fp32 gives, or fp32 is taken.
void DistrustBf16(const NetworkSource& source, const InferenceOptions& options,
                  CompiledNetwork* network) {
  ov::CompiledModel reference = CompileModel(source, options.threads, "fp32");
  const double difference = RelativeDifference(reference, network->compiled);
  if (difference <= kMaxBf16Difference) return;
  const auto level = options.precision == "bf16" ? spdlog::level::warn : spdlog::level::info;
  Log().log(level, "{}: computes in fp32, as what this CPU gives in bf16 differs by {:.0f} %",
            source.path.string(), 100 * difference);
  network->float_precision = "fp32";
  network->compiled = std::move(reference);
}

}  // namespace

/// In a quantised network the layers that are not quantised are those that bear the least error.
std::string FloatPrecision(const std::string& precision, bool is_quantised) {
  if (precision == "fp32" || precision == "bf16") return precision;
  return HasFastArithmetic("bf16") && !is_quantised ? "bf16" : "fp32";
}

void CompileOrLoad(const NetworkSource& source, const InferenceOptions& options,
                   CompiledNetwork* network) {
  const BlobCache cache(options.cache_dir);
  network->from_cache = Load(cache, source, options.threads, network);
  if (network->from_cache) return;
  network->compiled = CompileModel(source, options.threads, network->float_precision);
  if (network->float_precision == "bf16") DistrustBf16(source, options, network);
  if (!cache.enabled()) return;
  std::ostringstream stream;
  network->compiled.export_model(stream);
  cache.Store(CacheKey(source, options.threads, network->float_precision), stream.str());
}

/// A CPU without bf16 may be given fp32 in its place.
void NoteGrantedPrecision(const std::filesystem::path& path, CompiledNetwork* network) {
  const bool is_bf16 =
      network->compiled.get_property(ov::hint::inference_precision) == ov::element::bf16;
  const std::string granted = is_bf16 ? "bf16" : "fp32";
  if (granted == network->float_precision) return;
  Log().warn("{}: computes in {}, not {}", path.string(), granted, network->float_precision);
  network->float_precision = granted;
}

}  // namespace deepuav
