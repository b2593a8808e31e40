#include "deepuav/io/point_cloud.h"

#include <bit>
#include <cstring>

#include "deepuav/base/error.h"
#include "deepuav/io/atomic_file.h"

namespace deepuav {

void WritePly(const std::filesystem::path& file, std::span<const ColoredPoint> points) {
  static_assert(std::endian::native == std::endian::little,
                "the bytes are written as they lie in memory");
  AtomicFile output(file);
  output.Write(
      fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
                  "property float x\nproperty float y\nproperty float z\n"
                  "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
                  points.size()));
  std::array<char, 3 * sizeof(float) + 3> record;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f position = points[i].position.cast<float>();
    if (!position.allFinite()) throw Error("{}: point {} is not finite", file.string(), i);
    std::memcpy(record.data(), position.data(), 3 * sizeof(float));
    std::memcpy(record.data() + 3 * sizeof(float), points[i].rgb.data(), 3);
    output.Write({record.data(), record.size()});
  }
  output.Commit();
}

}  // namespace deepuav
