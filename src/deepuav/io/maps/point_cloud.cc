#include "deepuav/io/maps/point_cloud.h"

#include <bit>
#include <cstring>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

constexpr size_t kRecordBytes = 3 * sizeof(float) + 3;
constexpr size_t kMaxPlyBytes = size_t{4} << 30;

std::string Header(size_t points) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      points);
}

}  // namespace

void WritePly(const std::filesystem::path& file, std::span<const ColouredPoint> points) {
  static_assert(std::endian::native == std::endian::little,
                "the bytes are written as they lie in memory");
  AtomicFile output(file);
  output.Write(Header(points.size()));
  std::array<char, kRecordBytes> record;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f position = points[i].position.cast<float>();
    if (!position.allFinite()) throw Error("{}: point {} is not finite", file.string(), i);
    std::memcpy(record.data(), position.data(), 3 * sizeof(float));
    std::memcpy(record.data() + 3 * sizeof(float), points[i].rgb.data(), 3);
    output.Write({record.data(), record.size()});
  }
  output.Commit();
}

std::vector<ColouredPoint> ReadPly(const std::filesystem::path& file) {
  const std::string bytes = ReadBytes(file, kMaxPlyBytes);
  constexpr std::string_view kEnd = "end_header\n";
  const size_t end = bytes.find(kEnd);
  const size_t start = end == std::string::npos ? bytes.size() : end + kEnd.size();
  const size_t count = (bytes.size() - start) / kRecordBytes;
  if (bytes.substr(0, start) != Header(count) || start + count * kRecordBytes != bytes.size()) {
    throw Error(
        "{}: has another header or length: expected binary little-endian PLY with x y z as float, "
        "red green blue as uchar, and as many points as it says",
        file.string());
  }
  std::vector<ColouredPoint> points(count);
  for (size_t i = 0; i < count; ++i) {
    const char* record = bytes.data() + start + i * kRecordBytes;
    Eigen::Vector3f position;
    std::memcpy(position.data(), record, 3 * sizeof(float));
    std::memcpy(points[i].rgb.data(), record + 3 * sizeof(float), 3);
    if (!position.allFinite()) throw Error("{}: point {} is not finite", file.string(), i);
    points[i].position = position.cast<double>();
  }
  return points;
}

}  // namespace deepuav
