#pragma once

#include <string>

#include "deepuav/base/option_bounds.h"

namespace deepuav {

/// The arithmetic that InferenceOptions and SuperGlueOptions name.
inline TextBounds Precisions() { return OneOf({"auto", "fp32", "bf16", "int8"}); }

/// Whether this CPU computes in "fp32", "bf16" or "int8" by instructions of its own: what it must
/// emulate is slower than fp32.
bool HasFastArithmetic(const std::string& precision);

/// As the CPU names itself.
std::string CpuName();

}  // namespace deepuav
