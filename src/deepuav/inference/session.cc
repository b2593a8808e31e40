#include "deepuav/inference/session.h"

#include <algorithm>
#include <openvino/openvino.hpp>
#include <sstream>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/inference/blob_cache.h"
#include "deepuav/inference/network_file.h"
#include "deepuav/inference/precision_check.h"

namespace deepuav {
namespace {

constexpr char kDevice[] = "CPU";

/// Calls `step`, turning the runtime's exceptions into an Error that names the model's file.
template <typename Step>
auto Guarded(const std::filesystem::path& model, const char* what, Step&& step) {
  try {
    return step();
  } catch (const ov::Exception& exception) {
    throw Error("{}: {}: {}", model.string(), what, LastLine(exception.what()));
  }
}

/// What counts is the instruction, not that the runtime can.
bool HasFastBf16() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512bf16") > 0;  // AMX comes only with it.
#else
  const auto found = Core().get_property(kDevice, ov::device::capabilities);
  return std::find(found.begin(), found.end(), ov::device::capability::BF16) != found.end();
#endif
}

/// Without VNNI, too, int8 takes half to three quarters of the time that fp32 takes.
bool HasFastInt8() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") > 0;
#else
  const auto found = Core().get_property(kDevice, ov::device::capabilities);
  return std::find(found.begin(), found.end(), ov::device::capability::INT8) != found.end();
#endif
}

/// Of the layers that are not quantised; in a quantised network those that bear the least error.
std::string ResolveFloat(const std::string& precision, bool is_quantised) {
  if (precision == "fp32" || precision == "bf16") return precision;
  return HasFastBf16() && !is_quantised ? "bf16" : "fp32";
}

/// What bf16 may change in an output, as RelativeDifference measures it. Rounding changes 0.02.
constexpr double kMaxBf16Difference = 0.1;

TensorShape ShapeOf(const ov::PartialShape& partial) {
  if (partial.rank().is_dynamic()) return {};
  TensorShape shape;
  for (const auto& size : partial) shape.push_back(size.is_static() ? size.get_length() : kAnySize);
  return shape;
}

template <typename Ports>
std::vector<TensorInfo> DescribePorts(const Ports& ports) {
  std::vector<TensorInfo> infos;
  for (const auto& port : ports) {
    infos.push_back(
        {port.get_names().empty() ? port.get_node()->get_friendly_name() : port.get_any_name(),
         port.get_element_type().get_type_name(), ShapeOf(port.get_partial_shape())});
  }
  return infos;
}

size_t IndexOf(const std::vector<TensorInfo>& tensors, const std::string& name,
               const std::filesystem::path& model) {
  std::string known;
  for (size_t i = 0; i < tensors.size(); ++i) {
    if (tensors[i].name == name) return i;
    known += (i ? ", " : "") + tensors[i].name;
  }
  throw Error("{}: no tensor '{}': expected one of {}", model.string(), name, known);
}

}  // namespace

void InferenceOptions::Check() const { CheckOptions("inference", *this); }

bool HasFastArithmetic(const std::string& precision) {
  if (precision == "bf16") return HasFastBf16();
  if (precision == "int8") return HasFastInt8();
  return precision == "fp32";
}

std::string CpuName() { return Core().get_property(kDevice, ov::device::full_name); }

std::string ShapeText(const TensorShape& shape) {
  std::string text = "[";
  for (const int64_t size : shape) {
    if (text.size() > 1) text += ",";
    text += size == kAnySize ? "?" : std::to_string(size);
  }
  return text + "]";
}

struct Session::Impl {
  std::filesystem::path path;
  InferenceOptions options;
  std::string float_precision;  ///< Of the layers that are not quantised.
  bool is_quantised = false;
  std::string precision;
  std::string sha256;
  std::shared_ptr<ov::Model> model;
  std::vector<TensorInfo> inputs, outputs;
  ov::CompiledModel compiled;
  ov::InferRequest request;
  std::vector<const float*> input_values;  ///< As last given to the request.
  bool from_cache = false;

  std::map<ov::Output<ov::Node>, ov::PartialShape> MatchShapes(
      const std::map<std::string, TensorShape>& input_shapes) const;
  void ConvertToFloat(const std::set<std::string>& channels_last);
  ov::AnyMap Config() const;
  ov::CompiledModel CompileModel() const { return Core().compile_model(model, kDevice, Config()); }
  std::string CacheKey(const std::set<std::string>& channels_last) const;
  void CompileOrLoad(const std::set<std::string>& channels_last);
  void DistrustBf16();
  bool Load(const BlobCache& cache, const std::string& cache_key);
  void NoteGrantedPrecision();
  void NamePrecision() { precision = (is_quantised ? "int8+" : "") + float_precision; }
};

/// The shape of every input, checked against the model.
std::map<ov::Output<ov::Node>, ov::PartialShape> Session::Impl::MatchShapes(
    const std::map<std::string, TensorShape>& input_shapes) const {
  std::map<ov::Output<ov::Node>, ov::PartialShape> shapes;
  for (const auto& [name, shape] : input_shapes) {
    const size_t index = IndexOf(inputs, name, path);
    const ov::PartialShape wanted(std::vector<ov::Dimension>(shape.begin(), shape.end()));
    if (wanted.is_dynamic() || !model->input(index).get_partial_shape().compatible(wanted)) {
      throw Error("{}: input '{}' cannot have the shape {}: expected {}", path.string(), name,
                  ShapeText(shape), ShapeText(inputs[index].shape));
    }
    shapes[model->input(index)] = wanted;
  }
  for (const TensorInfo& input : inputs) {
    if (!input_shapes.contains(input.name)) {
      throw Error("{}: no shape for the input '{}': expected one that fits {}", path.string(),
                  input.name, ShapeText(input.shape));
    }
  }
  return shapes;
}

void Session::Impl::ConvertToFloat(const std::set<std::string>& channels_last) {
  ov::preprocess::PrePostProcessor converter(model);
  for (size_t i = 0; i < inputs.size(); ++i) {
    converter.input(i).tensor().set_element_type(ov::element::f32);
  }
  for (size_t i = 0; i < outputs.size(); ++i) {
    converter.output(i).tensor().set_element_type(ov::element::f32);
    if (channels_last.contains(outputs[i].name)) {
      converter.output(i).model().set_layout("NCHW");
      converter.output(i).tensor().set_layout("NHWC");
    }
  }
  model = converter.build();
}

ov::AnyMap Session::Impl::Config() const {
  // Pinned threads of two networks that run at the same time would share cores while others are
  // idle, and without hyper-threads the runtime grants fewer threads than asked for.
  return {ov::inference_num_threads(options.threads),
          ov::num_streams(1),
          ov::hint::performance_mode(ov::hint::PerformanceMode::LATENCY),
          ov::hint::inference_precision(float_precision == "bf16" ? ov::element::bf16
                                                                  : ov::element::f32),
          ov::hint::enable_cpu_pinning(false),
          ov::hint::enable_hyper_threading(true)};
}

/// All that the compiled network depends on.
std::string Session::Impl::CacheKey(const std::set<std::string>& channels_last) const {
  const std::string checked = float_precision == "bf16" ? "checked " : "";
  std::string key =
      fmt::format("{} {} {}{} {} {} {}", sha256, WeightsSha256(*model), checked, float_precision,
                  options.threads, ov::get_openvino_version().buildNumber,
                  Core().get_property(kDevice, ov::device::full_name));
  for (const auto& capability : Core().get_property(kDevice, ov::device::capabilities))
    key += " " + capability;
  for (const TensorInfo& input : inputs) key += " " + input.name + ShapeText(input.shape);
  for (const auto& name : channels_last) key += " " + name;
  return key;
}

bool Session::Impl::Load(const BlobCache& cache, const std::string& cache_key) {
  const auto blob = cache.Load(cache_key);
  if (!blob) return false;
  try {
    std::istringstream stream(*blob);
    compiled = Core().import_model(stream, kDevice, Config());
    return true;
  } catch (const std::exception& exception) {
    Log().warn("{}: the compiled network in the cache is not used: {}", path.string(),
               LastLine(exception.what()));
    return false;
  }
}

void Session::Impl::CompileOrLoad(const std::set<std::string>& channels_last) {
  const BlobCache cache(options.cache_dir);
  from_cache = Load(cache, CacheKey(channels_last));
  if (from_cache) return;
  compiled = CompileModel();
  if (float_precision == "bf16") DistrustBf16();
  if (!cache.enabled()) return;
  std::ostringstream stream;
  compiled.export_model(stream);
  cache.Store(CacheKey(channels_last), stream.str());
}

/// OpenVINO 2026.4 computes some convolutions wrongly by AMX in bf16 (kernels of 4 pixels at steps
/// of 4 over 16 channels, for one), silently. So bf16 must give what fp32 gives, or fp32 is taken.
void Session::Impl::DistrustBf16() {
  float_precision = "fp32";
  ov::CompiledModel reference = CompileModel();
  const double difference = RelativeDifference(reference, compiled);
  if (difference <= kMaxBf16Difference) {
    float_precision = "bf16";
    return;
  }
  const auto level = options.precision == "bf16" ? spdlog::level::warn : spdlog::level::info;
  Log().log(level, "{}: computes in fp32, as what this CPU gives in bf16 differs by {:.0f} %",
            path.string(), 100 * difference);
  compiled = std::move(reference);
  NamePrecision();
}

/// A CPU without bf16 may be given fp32 in its place.
void Session::Impl::NoteGrantedPrecision() {
  const bool is_bf16 = compiled.get_property(ov::hint::inference_precision) == ov::element::bf16;
  const std::string granted = is_bf16 ? "bf16" : "fp32";
  if (granted == float_precision) return;
  Log().warn("{}: computes in {}, not {}", path.string(), granted, float_precision);
  float_precision = granted;
  NamePrecision();
}

Session::Session(std::filesystem::path model, const InferenceOptions& options)
    : impl_(std::make_unique<Impl>()) {
  options.Check();
  impl_->path = std::move(model);
  impl_->options = options;
  impl_->model = ReadModel(impl_->path);
  impl_->is_quantised = IsQuantised(*impl_->model);
  impl_->float_precision = ResolveFloat(options.precision, impl_->is_quantised);
  if (options.precision == "int8" && !impl_->is_quantised) {
    throw Error("{}: is not quantised: expected a network with int8 layers for the precision int8",
                impl_->path.string());
  }
  impl_->NamePrecision();
  impl_->sha256 = ModelSha256(impl_->path);
  impl_->inputs = DescribePorts(impl_->model->inputs());
  impl_->outputs = DescribePorts(impl_->model->outputs());
}

Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

const std::filesystem::path& Session::model() const { return impl_->path; }
const std::vector<TensorInfo>& Session::inputs() const { return impl_->inputs; }
const std::vector<TensorInfo>& Session::outputs() const { return impl_->outputs; }
const std::string& Session::precision() const { return impl_->precision; }
const std::string& Session::sha256() const { return impl_->sha256; }
bool Session::from_cache() const { return impl_->from_cache; }

int Session::threads() const {
  if (!impl_->compiled) throw Error("{}: not compiled yet", impl_->path.string());
  return impl_->compiled.get_property(ov::inference_num_threads);
}

void Session::Reshape(const std::map<std::string, TensorShape>& input_shapes) {
  if (impl_->compiled) throw Error("{}: compiled already", impl_->path.string());
  const auto shapes = impl_->MatchShapes(input_shapes);
  Guarded(impl_->path, "cannot have these input shapes", [&] { impl_->model->reshape(shapes); });
  impl_->inputs = DescribePorts(impl_->model->inputs());
  impl_->outputs = DescribePorts(impl_->model->outputs());
}

void Session::Compile(const std::set<std::string>& channels_last) {
  if (impl_->compiled) throw Error("{}: compiled already", impl_->path.string());
  for (const auto& name : channels_last) IndexOf(impl_->outputs, name, impl_->path);
  for (const TensorInfo& input : impl_->inputs) {
    if (std::count(input.shape.begin(), input.shape.end(), kAnySize)) {
      throw Error("{}: input '{}' has the open shape {}: expected a fixed one",
                  impl_->path.string(), input.name, ShapeText(input.shape));
    }
  }
  Guarded(impl_->path, "cannot be compiled", [&] {
    impl_->ConvertToFloat(channels_last);
    for (size_t i = 0; i < impl_->outputs.size(); ++i) {
      impl_->outputs[i].shape = ShapeOf(impl_->model->output(i).get_partial_shape());
    }
    impl_->CompileOrLoad(channels_last);
    impl_->model.reset();
    impl_->request = impl_->compiled.create_infer_request();
    impl_->input_values.assign(impl_->inputs.size(), nullptr);
  });
  impl_->NoteGrantedPrecision();
  if (threads() != impl_->options.threads) {
    Log().warn("{}: runs on {} threads, not {}", impl_->path.string(), threads(),
               impl_->options.threads);
  }
}

void Session::SetInput(const std::string& name, std::span<const float> values) {
  if (!impl_->compiled) throw Error("{}: not compiled yet", impl_->path.string());
  const size_t index = IndexOf(impl_->inputs, name, impl_->path);
  const TensorShape& shape = impl_->inputs[index].shape;
  const ov::Shape sizes(shape.begin(), shape.end());
  if (values.size() != ov::shape_size(sizes)) {
    throw Error("{}: input '{}' is given {} values: expected {} for its shape {}",
                impl_->path.string(), name, values.size(), ov::shape_size(sizes), ShapeText(shape));
  }
  if (impl_->input_values[index] == values.data()) return;
  Guarded(impl_->path, "input refused", [&] {
    impl_->request.set_input_tensor(index, ov::Tensor(ov::element::f32, sizes, values.data()));
  });
  impl_->input_values[index] = values.data();
}

void Session::Run() {
  if (!impl_->compiled) throw Error("{}: not compiled yet", impl_->path.string());
  for (size_t i = 0; i < impl_->inputs.size(); ++i) {
    if (!impl_->input_values[i]) {
      throw Error("{}: the input '{}' was never set", impl_->path.string(), impl_->inputs[i].name);
    }
  }
  Guarded(impl_->path, "cannot be run", [&] { impl_->request.infer(); });
}

std::span<const float> Session::Output(const std::string& name) const {
  if (!impl_->compiled) throw Error("{}: not compiled yet", impl_->path.string());
  const ov::Tensor tensor =
      impl_->request.get_output_tensor(IndexOf(impl_->outputs, name, impl_->path));
  return {static_cast<const float*>(std::as_const(tensor).data()), tensor.get_size()};
}

TensorShape Session::OutputShape(const std::string& name) const {
  if (!impl_->compiled) throw Error("{}: not compiled yet", impl_->path.string());
  const auto shape =
      impl_->request.get_output_tensor(IndexOf(impl_->outputs, name, impl_->path)).get_shape();
  return {shape.begin(), shape.end()};
}

}  // namespace deepuav
