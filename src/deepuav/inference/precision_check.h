#pragma once

#include <openvino/openvino.hpp>

namespace deepuav {

/// How far the outputs of two networks of the same inputs are apart on noise of 0 to 1: of each
/// output the root mean square of the difference by that of the reference, the largest of all.
double RelativeDifference(ov::CompiledModel& reference, ov::CompiledModel& other);

}  // namespace deepuav
