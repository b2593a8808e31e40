#include "deepuav/inference/cpu_arithmetic.h"

#include <algorithm>
#include <openvino/openvino.hpp>

#include "deepuav/inference/network_file.h"

namespace deepuav {
namespace {

constexpr char kDevice[] = "CPU";

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

}  // namespace

bool HasFastArithmetic(const std::string& precision) {
  if (precision == "bf16") return HasFastBf16();
  if (precision == "int8") return HasFastInt8();
  return precision == "fp32";
}

std::string CpuName() { return Core().get_property(kDevice, ov::device::full_name); }

}  // namespace deepuav
