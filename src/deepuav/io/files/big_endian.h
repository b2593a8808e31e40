#pragma once

#include <cassert>
#include <concepts>
#include <cstdint>
#include <string_view>

namespace deepuav {

/// The big-endian number at `at`, which must lie within the bytes.
template <std::unsigned_integral T>
T GetBigEndian(std::string_view bytes, size_t at) {
  assert(at + sizeof(T) <= bytes.size());
  T value = 0;
  for (size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<T>(static_cast<uint64_t>(value) << 8 | static_cast<uint8_t>(bytes[at + i]));
  return value;
}

}  // namespace deepuav
