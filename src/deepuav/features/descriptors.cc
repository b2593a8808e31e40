#include "deepuav/features/descriptors.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/features/dot_kernels.h"

namespace deepuav {
namespace {

constexpr float kLargestStored = 127;

void CheckDimensions(int found, int expected) {
  if (found != expected) throw Error("descriptors of dimension {}: expected {}", found, expected);
}

}  // namespace

Descriptors Descriptors::FromStored(int dimension, std::vector<int8_t> values,
                                    std::vector<float> scales) {
  if (dimension < 1) throw Error("descriptors of dimension {}: expected at least 1", dimension);
  if (values.size() != scales.size() * static_cast<size_t>(dimension)) {
    throw Error("{} values of descriptors: expected {} rows of {}", values.size(), scales.size(),
                dimension);
  }
  if (std::find(values.begin(), values.end(), INT8_MIN) != values.end()) {
    throw Error("a descriptor has the value -128: expected -127 to 127");
  }
  for (size_t i = 0; i < scales.size(); ++i) {
    if (!std::isfinite(scales[i]) || scales[i] < 0) {
      throw Error("descriptor {} has the scale {}: expected a finite one, not negative", i,
                  scales[i]);
    }
  }
  Descriptors descriptors(dimension);
  descriptors.values_ = std::move(values);
  descriptors.scales_ = std::move(scales);
  return descriptors;
}

void Descriptors::Reserve(int rows) {
  values_.reserve(static_cast<size_t>(rows) * static_cast<size_t>(dimension_));
  scales_.reserve(static_cast<size_t>(rows));
}

void Descriptors::Append(std::span<const float> row) {
  CheckDimensions(static_cast<int>(row.size()), dimension_);
  const Eigen::Map<const Eigen::ArrayXf> values(row.data(), dimension_);
  // The sum of squares is finite only if all values are.
  if (!std::isfinite(values.square().sum())) {
    throw Error("descriptor {} has a value that is not finite", size());
  }
  const float largest = values.abs().maxCoeff();
  const float to_stored = kLargestStored / largest;
  // A row too small for its inverse to be finite is stored as zero.
  const bool is_zero = !std::isfinite(to_stored);
  const size_t begin = values_.size();
  values_.resize(begin + row.size());
  if (!is_zero) {
    int8_t* stored = values_.data() + begin;
    for (size_t k = 0; k < row.size(); ++k) {
      stored[k] = static_cast<int8_t>(static_cast<int32_t>(std::nearbyint(row[k] * to_stored)));
    }
  }
  scales_.push_back(is_zero ? 0.0f : largest / kLargestStored);
}

void Descriptors::AppendFrom(const Descriptors& other, int index) {
  CheckDimensions(other.dimension_, dimension_);
  const auto first = static_cast<size_t>(index) * static_cast<size_t>(dimension_);
  const auto dimension = static_cast<size_t>(dimension_);
  values_.resize(values_.size() + dimension);
  std::copy_n(other.values_.data() + first, dimension, values_.data() + values_.size() - dimension);
  scales_.push_back(float{other.scales_[static_cast<size_t>(index)]});
}

void Descriptors::Read(int index, std::span<float> row) const {
  CheckDimensions(static_cast<int>(row.size()), dimension_);
  const int8_t* stored = values_.data() + static_cast<size_t>(index) * row.size();
  const float scale = scales_[static_cast<size_t>(index)];
  for (size_t k = 0; k < row.size(); ++k) row[k] = scale * static_cast<float>(stored[k]);
}

float Descriptors::Similarity(int i, const Descriptors& other, int j) const {
  CheckDimensions(other.dimension_, dimension_);
  const ptrdiff_t dimension = dimension_;
  const int32_t dot = FastestDotKernels().dot(values_.data() + i * dimension,
                                              other.values_.data() + j * dimension, dimension_);
  return static_cast<float>(dot) *
         (scales_[static_cast<size_t>(i)] * other.scales_[static_cast<size_t>(j)]);
}

void Descriptors::SimilarityMatrix(const Descriptors& other, std::span<float> out) const {
  CheckDimensions(other.dimension_, dimension_);
  const auto columns = static_cast<size_t>(other.size());
  if (out.size() != scales_.size() * columns) {
    throw Error("room for {} similarities: expected {} x {}", out.size(), size(), other.size());
  }
  FastestDotKernels().matrix({values_.data(), scales_.data(), size()},
                             {other.values_.data(), other.scales_.data(), other.size()}, dimension_,
                             out.data());
}

}  // namespace deepuav
