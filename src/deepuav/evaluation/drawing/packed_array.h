#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace deepuav {

/// RFC 4648, with padding.
std::string Base64(std::string_view bytes);

// Arrays of numbers as JSON that a page unpacks: {"type": "f32" | "u16" | "u8", "data": base64 of
// little-endian numbers}.
nlohmann::json PackFloats(const std::vector<float>& values);
nlohmann::json PackShorts(const std::vector<uint16_t>& values);
nlohmann::json PackBytes(const std::vector<uint8_t>& values);

/// Points as 16-bit numbers a coordinate within their bounding box: {"low": [3], "size": [3],
/// "points": u16 array}; x = low + size * n / 65535.
nlohmann::json PackPoints(const std::vector<Eigen::Vector3f>& points);

}  // namespace deepuav
