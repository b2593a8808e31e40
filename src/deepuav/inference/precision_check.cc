#include "deepuav/inference/precision_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr unsigned kNoiseSeed = 1;

std::vector<ov::Tensor> NoiseFor(const ov::CompiledModel& network) {
  Random random(kNoiseSeed);
  std::vector<ov::Tensor> inputs;
  for (const auto& port : network.inputs()) {
    inputs.emplace_back(ov::element::f32, port.get_shape());
    float* const values = inputs.back().data<float>();
    std::generate_n(values, inputs.back().get_size(),
                    [&] { return static_cast<float>(random.Uniform(0, 1)); });
  }
  return inputs;
}

ov::InferRequest RunOn(const std::vector<ov::Tensor>& inputs, ov::CompiledModel& network) {
  ov::InferRequest request = network.create_infer_request();
  for (size_t i = 0; i < inputs.size(); ++i) request.set_input_tensor(i, inputs[i]);
  request.infer();
  return request;
}

double RelativeDifference(const ov::Tensor& reference, const ov::Tensor& other) {
  const float* const a = reference.data<float>();
  const float* const b = other.data<float>();
  double squares = 0, squared_differences = 0;
  for (size_t i = 0; i < reference.get_size(); ++i) {
    const double difference = static_cast<double>(b[i]) - static_cast<double>(a[i]);
    squares += static_cast<double>(a[i]) * static_cast<double>(a[i]);
    squared_differences += difference * difference;
  }
  if (squared_differences == 0) return 0;
  const double ratio = std::sqrt(squared_differences / squares);
  return std::isnan(ratio) ? std::numeric_limits<double>::infinity() : ratio;
}

}  // namespace

double RelativeDifference(ov::CompiledModel& reference, ov::CompiledModel& other) {
  const std::vector<ov::Tensor> noise = NoiseFor(reference);
  ov::InferRequest of_reference = RunOn(noise, reference), of_other = RunOn(noise, other);
  double largest = 0;
  for (size_t i = 0; i < reference.outputs().size(); ++i) {
    largest = std::max(largest, RelativeDifference(of_reference.get_output_tensor(i),
                                                   of_other.get_output_tensor(i)));
  }
  return largest;
}

}  // namespace deepuav
