#include "deepuav/inference/session.h"

#include <algorithm>
#include <openvino/openvino.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/inference/network_compilation.h"
#include "deepuav/inference/network_file.h"

namespace deepuav {
namespace {

/// Calls `step`, turning the runtime's exceptions into an Error that names the model's file.
template <typename Step>
auto Guarded(const std::filesystem::path& model, const char* what, Step&& step) {
  try {
    return step();
  } catch (const ov::Exception& exception) {
    throw Error("{}: {}: {}", model.string(), what, LastLine(exception.what()));
  }
}

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
  bool is_quantised = false;
  std::string precision;
  std::string sha256;
  std::shared_ptr<ov::Model> model;
  std::vector<TensorInfo> inputs, outputs;
  CompiledNetwork network;
  ov::InferRequest request;
  std::vector<const float*> input_values;  ///< As last given to the request.

  std::map<ov::Output<ov::Node>, ov::PartialShape> MatchShapes(
      const std::map<std::string, TensorShape>& input_shapes) const;
  void ConvertToFloat(const std::set<std::string>& channels_last);
  void NamePrecision() { precision = (is_quantised ? "int8+" : "") + network.float_precision; }
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

Session::Session(std::filesystem::path model, const InferenceOptions& options)
    : impl_(std::make_unique<Impl>()) {
  options.Check();
  impl_->path = std::move(model);
  impl_->options = options;
  impl_->model = ReadModel(impl_->path);
  impl_->is_quantised = IsQuantised(*impl_->model);
  impl_->network.float_precision = FloatPrecision(options.precision, impl_->is_quantised);
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
bool Session::from_cache() const { return impl_->network.from_cache; }

int Session::threads() const {
  if (!impl_->network.compiled) throw Error("{}: not compiled yet", impl_->path.string());
  return impl_->network.compiled.get_property(ov::inference_num_threads);
}

void Session::Reshape(const std::map<std::string, TensorShape>& input_shapes) {
  if (impl_->network.compiled) throw Error("{}: compiled already", impl_->path.string());
  const auto shapes = impl_->MatchShapes(input_shapes);
  Guarded(impl_->path, "cannot have these input shapes", [&] { impl_->model->reshape(shapes); });
  impl_->inputs = DescribePorts(impl_->model->inputs());
  impl_->outputs = DescribePorts(impl_->model->outputs());
}

void Session::Compile(const std::set<std::string>& channels_last) {
  if (impl_->network.compiled) throw Error("{}: compiled already", impl_->path.string());
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
    CompileOrLoad({impl_->path, impl_->sha256, impl_->model, impl_->inputs, channels_last},
                  impl_->options, &impl_->network);
    impl_->NamePrecision();
    impl_->model.reset();
    impl_->request = impl_->network.compiled.create_infer_request();
    impl_->input_values.assign(impl_->inputs.size(), nullptr);
  });
  NoteGrantedPrecision(impl_->path, &impl_->network);
  impl_->NamePrecision();
  if (threads() != impl_->options.threads) {
    Log().warn("{}: runs on {} threads, not {}", impl_->path.string(), threads(),
               impl_->options.threads);
  }
}

void Session::SetInput(const std::string& name, std::span<const float> values) {
  if (!impl_->network.compiled) throw Error("{}: not compiled yet", impl_->path.string());
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
  if (!impl_->network.compiled) throw Error("{}: not compiled yet", impl_->path.string());
  for (size_t i = 0; i < impl_->inputs.size(); ++i) {
    if (!impl_->input_values[i]) {
      throw Error("{}: the input '{}' was never set", impl_->path.string(), impl_->inputs[i].name);
    }
  }
  Guarded(impl_->path, "cannot be run", [&] { impl_->request.infer(); });
}

std::span<const float> Session::Output(const std::string& name) const {
  if (!impl_->network.compiled) throw Error("{}: not compiled yet", impl_->path.string());
  const ov::Tensor tensor =
      impl_->request.get_output_tensor(IndexOf(impl_->outputs, name, impl_->path));
  return {static_cast<const float*>(std::as_const(tensor).data()), tensor.get_size()};
}

TensorShape Session::OutputShape(const std::string& name) const {
  if (!impl_->network.compiled) throw Error("{}: not compiled yet", impl_->path.string());
  const auto shape =
      impl_->request.get_output_tensor(IndexOf(impl_->outputs, name, impl_->path)).get_shape();
  return {shape.begin(), shape.end()};
}

}  // namespace deepuav
