#include "deepuav/evaluation/drawing/packed_array.h"

#include <gtest/gtest.h>

#include <cstring>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

std::string Decode(const std::string& text) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  uint32_t group = 0;
  int bits = 0;
  for (const char digit : text) {
    if (digit == '=') break;
    group = group << 6 | static_cast<uint32_t>(kDigits.find(digit));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(group >> bits & 0xff);
  }
  return bytes;
}

TEST(PackedArray, Base64IsThatOfTheStandard) {
  // RFC 4648, section 10.
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foob"), "Zm9vYg==");
  EXPECT_EQ(Base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
}

TEST(PackedArray, FloatsComeBack) {
  const std::vector<float> values = {0, -1.5f, 3e20f, 1e-30f};
  const nlohmann::json packed = PackFloats(values);
  EXPECT_EQ(packed["type"], "f32");
  const std::string bytes = Decode(packed["data"]);
  ASSERT_EQ(bytes.size(), values.size() * sizeof(float));
  EXPECT_EQ(std::memcmp(bytes.data(), values.data(), bytes.size()), 0);
}

TEST(PackedArray, PointsComeBackToHalfAStep) {
  Random random(7);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 200; ++i) {
    points.emplace_back(static_cast<float>(random.Uniform(-300, 500)),
                        static_cast<float>(random.Uniform(2, 3)), 7.0f);
  }
  const nlohmann::json packed = PackPoints(points);
  const std::string bytes = Decode(packed["points"]["data"]);
  ASSERT_EQ(bytes.size(), 3 * points.size() * sizeof(uint16_t));
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      uint16_t number = 0;
      std::memcpy(&number, bytes.data() + sizeof(number) * (3 * i + axis), sizeof(number));
      const float size = packed["size"][axis];
      const float value =
          packed["low"][axis].get<float>() + size * static_cast<float>(number) / 65535;
      EXPECT_NEAR(value, points[i][static_cast<int>(axis)], 0.51 * size / 65535 + 1e-4);
    }
  }
}

}  // namespace
}  // namespace deepuav
