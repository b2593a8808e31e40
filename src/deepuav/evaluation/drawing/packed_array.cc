#include "deepuav/evaluation/drawing/packed_array.h"

#include <bit>
#include <cmath>
#include <limits>

namespace deepuav {
namespace {

static_assert(std::endian::native == std::endian::little,
              "numbers are packed as they lie in memory");

template <typename T>
nlohmann::json Pack(const char* type, const std::vector<T>& values) {
  const std::string_view bytes(reinterpret_cast<const char*>(values.data()),
                               values.size() * sizeof(T));
  return {{"type", type}, {"data", Base64(bytes)}};
}

nlohmann::json ArrayOf(const Eigen::Vector3f& vector) {
  return nlohmann::json::array({vector.x(), vector.y(), vector.z()});
}

}  // namespace

std::string Base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    uint32_t group = 0;
    for (size_t j = 0; j < 3; ++j) {
      group = group << 8 | (j < count ? static_cast<uint8_t>(bytes[i + j]) : 0u);
    }
    for (size_t j = 0; j < 4; ++j) {
      text += j <= count ? kDigits[group >> (18 - 6 * j) & 63] : '=';
    }
  }
  return text;
}

nlohmann::json PackFloats(const std::vector<float>& values) { return Pack("f32", values); }
nlohmann::json PackShorts(const std::vector<uint16_t>& values) { return Pack("u16", values); }
nlohmann::json PackBytes(const std::vector<uint8_t>& values) { return Pack("u8", values); }

nlohmann::json PackPoints(const std::vector<Eigen::Vector3f>& points) {
  constexpr float kSteps = std::numeric_limits<uint16_t>::max();
  Eigen::Vector3f low = Eigen::Vector3f::Zero(), high = low;
  if (!points.empty()) low = high = points.front();
  for (const Eigen::Vector3f& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector3f size = high - low;
  std::vector<uint16_t> numbers;
  numbers.reserve(3 * points.size());
  for (const Eigen::Vector3f& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      const float share = size[axis] > 0 ? (point[axis] - low[axis]) / size[axis] : 0;
      numbers.push_back(static_cast<uint16_t>(std::lround(share * kSteps)));
    }
  }
  return {{"low", ArrayOf(low)}, {"size", ArrayOf(size)}, {"points", PackShorts(numbers)}};
}

}  // namespace deepuav
