#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace deepuav {

struct ColouredPoint {
  Eigen::Vector3d position;  ///< m
  std::array<uint8_t, 3> rgb{};

  static ColouredPoint Grey(const Eigen::Vector3d& position, uint8_t grey) {
    return {position, {grey, grey, grey}};
  }
};

/// Writes the points as binary little-endian PLY (x y z as float, red green blue as uchar),
/// atomically. Throws Error naming the file, also for a position that is not finite.
void WritePly(const std::filesystem::path& file, std::span<const ColouredPoint> points);

/// Reads what WritePly wrote: that one header, and points to the file's end. Throws Error naming
/// the file, what was found and what was expected.
std::vector<ColouredPoint> ReadPly(const std::filesystem::path& file);

}  // namespace deepuav
