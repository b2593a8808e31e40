#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "deepuav/api/types.h"

namespace deepuav::python {

namespace nb = nanobind;

/// Bytes of height x width, or height x width x 3 as red, green and blue.
using PixelArray = nb::ndarray<const std::uint8_t, nb::c_contig, nb::device::cpu>;
using TimeArray = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using PoseArray = nb::ndarray<const double, nb::shape<-1, 4, 4>, nb::c_contig, nb::device::cpu>;

/// An array of numpy that owns the numbers; `row_shape` is what follows the first dimension.
template <typename T>
nb::ndarray<nb::numpy, T> MakeArray(std::vector<T> numbers, std::size_t rows,
                                    const std::vector<std::size_t>& row_shape = {}) {
  auto* owned = new std::vector<T>(std::move(numbers));
  const nb::capsule owner(owned,
                          [](void* data) noexcept { delete static_cast<std::vector<T>*>(data); });
  std::vector<std::size_t> shape = {rows};
  shape.insert(shape.end(), row_shape.begin(), row_shape.end());
  return {owned->data(), shape.size(), shape.data(), owner};
}

/// Appends the 4x4 matrix by rows.
void AppendMatrix(const api::Pose& pose, std::vector<double>* numbers);
/// As an array.
nb::ndarray<nb::numpy, double> PoseMatrix(const api::Pose& pose);
/// 16 numbers that are not.
void AppendNoMatrix(std::vector<double>* numbers);

/// Throws api::Error for an array of another shape.
api::ImageView ViewOf(const PixelArray& pixels);
/// Throws api::Error for a matrix that is no rotation and translation.
api::Pose PoseOf(const double* matrix);
std::vector<api::TimedPose> PosesOf(const TimeArray& times, const PoseArray& poses);

nb::dict KeyframeTable(const std::vector<api::Keyframe>& keyframes);
/// The positions, a row each.
nb::ndarray<nb::numpy, double> PointArray(const std::vector<api::Landmark>& landmarks);
nb::dict LandmarkTable(const std::vector<api::Landmark>& landmarks);

}  // namespace deepuav::python
