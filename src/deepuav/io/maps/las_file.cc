#include "deepuav/io/maps/las_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/files/byte_stream.h"

namespace deepuav {
namespace {

constexpr uint16_t kHeaderBytes = 227, kRecordBytes = 26;
constexpr uint16_t kKeyBytes = 32, kSystemBytes = 54 + kKeyBytes;
constexpr uint8_t kPointFormat = 2;
constexpr size_t kNameBytes = 32;
constexpr size_t kReturns = 5;
constexpr uint8_t kOnlyReturn = 1 | 1 << 3;  // the first of one
constexpr uint16_t kFullColour = 257;        // 255 * 257 = 65535
constexpr int kFinestScale = -6;

/// How coordinates become integers: coordinate = offset + scale * integer.
struct Grid {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  double scale = 1;

  std::array<int32_t, 3> Quantise(const Eigen::Vector3d& position) const {
    std::array<int32_t, 3> steps;
    for (int axis = 0; axis < 3; ++axis) {
      const double along = (position[axis] - offset[axis]) / scale;
      steps[static_cast<size_t>(axis)] = static_cast<int32_t>(std::lround(along));
    }
    return steps;
  }
  Eigen::Vector3d Position(const std::array<int32_t, 3>& steps) const {
    return offset + scale * Eigen::Vector3d(steps[0], steps[1], steps[2]);
  }
};

void CheckFinite(const std::filesystem::path& file, std::span<const ColouredPoint> points) {
  for (size_t i = 0; i < points.size(); ++i) {
    if (!points[i].position.allFinite())
      throw Error("{}: point {} is not finite", file.string(), i);
  }
}

/// The finest whose integers hold all points.
Grid GridOf(const std::filesystem::path& file, std::span<const ColouredPoint> points) {
  if (points.empty()) return {};
  Eigen::Vector3d low = points.front().position, high = low;
  for (const ColouredPoint& point : points) {
    low = low.cwiseMin(point.position);
    high = high.cwiseMax(point.position);
  }
  Grid grid{low.array().floor(), 0};
  const double largest = (high - grid.offset).maxCoeff();
  if (!std::isfinite(largest)) throw Error("{}: the points are too far apart", file.string());
  for (int exponent = kFinestScale;; ++exponent) {
    grid.scale = std::pow(10.0, exponent);
    if (largest / grid.scale < std::numeric_limits<int32_t>::max()) return grid;
  }
}

/// The box of the points as they are written.
struct Bounds {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
};

Bounds BoundsOf(std::span<const ColouredPoint> points, const Grid& grid) {
  Bounds bounds;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d position = grid.Position(grid.Quantise(points[i].position));
    bounds.low = i == 0 ? position : bounds.low.cwiseMin(position);
    bounds.high = i == 0 ? position : bounds.high.cwiseMax(position);
  }
  return bounds;
}

void PutName(std::string_view name, ByteWriter* writer) {
  std::array<char, kNameBytes> padded{};
  std::copy_n(name.begin(), std::min(name.size(), padded.size()), padded.begin());
  writer->PutAll(std::span<const char>(padded));
}

/// The public header block, field by field as in section 3 of the specification.
void PutHeader(uint32_t count, const Grid& grid, const Bounds& bounds, bool has_system,
               ByteWriter* writer) {
  constexpr std::array<char, 4> kSignature = {'L', 'A', 'S', 'F'};
  constexpr std::array<uint8_t, 16> kNoProject = {};
  constexpr uint8_t kMajor = 1, kMinor = 2;
  writer->PutAll(std::span<const char>(kSignature));
  writer->Put<uint16_t>(0);  // file source
  writer->Put<uint16_t>(0);  // global encoding
  writer->PutAll(std::span<const uint8_t>(kNoProject));
  writer->Put<uint8_t>(kMajor);
  writer->Put<uint8_t>(kMinor);
  PutName("OTHER", writer);
  PutName("Deep-UAV SLAM", writer);
  writer->Put<uint16_t>(0);  // day of creation
  writer->Put<uint16_t>(0);  // and its year
  writer->Put<uint16_t>(kHeaderBytes);
  writer->Put<uint32_t>(kHeaderBytes + (has_system ? kSystemBytes : 0));  // where points begin
  writer->Put<uint32_t>(has_system ? 1 : 0);                              // variable-length records
  writer->Put<uint8_t>(kPointFormat);
  writer->Put<uint16_t>(kRecordBytes);
  writer->Put<uint32_t>(count);
  std::array<uint32_t, kReturns> by_return = {count};
  writer->PutAll(std::span<const uint32_t>(by_return));
  for (int axis = 0; axis < 3; ++axis) writer->Put<double>(grid.scale);
  for (int axis = 0; axis < 3; ++axis) writer->Put<double>(grid.offset[axis]);
  for (int axis = 0; axis < 3; ++axis) {
    writer->Put<double>(bounds.high[axis]);
    writer->Put<double>(bounds.low[axis]);
  }
}

/// The variable-length record of GeoTIFF keys that name a projected system in metres.
void PutSystem(int epsg, ByteWriter* writer) {
  constexpr std::string_view kUser = "LASF_Projection";
  constexpr uint16_t kDirectory = 34735, kModel = 1024, kProjected = 1, kSystem = 3072,
                     kUnit = 3076, kMetre = 9001;
  std::array<char, 16> user{};
  std::copy(kUser.begin(), kUser.end(), user.begin());
  writer->Put<uint16_t>(0);
  writer->PutAll(std::span<const char>(user));
  writer->Put<uint16_t>(kDirectory);
  writer->Put<uint16_t>(kKeyBytes);
  PutName("GeoTIFF keys", writer);
  const std::array<uint16_t, kKeyBytes / 2> keys = {
      1,       1, 0, 3,                            // version, revision, number of keys
      kModel,  0, 1, kProjected,                   //
      kSystem, 0, 1, static_cast<uint16_t>(epsg),  //
      kUnit,   0, 1, kMetre};
  writer->PutAll(std::span<const uint16_t>(keys));
}

void PutPoint(const ColouredPoint& point, const Grid& grid, ByteWriter* writer) {
  writer->PutAll(std::span<const int32_t>(grid.Quantise(point.position)));
  writer->Put<uint16_t>(0);  // intensity
  writer->Put<uint8_t>(kOnlyReturn);
  writer->Put<uint8_t>(0);   // class: never classified
  writer->Put<int8_t>(0);    // scan angle
  writer->Put<uint8_t>(0);   // user data
  writer->Put<uint16_t>(0);  // point source
  for (uint8_t channel : point.rgb)
    writer->Put<uint16_t>(static_cast<uint16_t>(kFullColour * channel));
}

}  // namespace

void WriteLas(const std::filesystem::path& file, std::span<const ColouredPoint> points,
              std::optional<int> epsg) {
  if (points.size() > std::numeric_limits<uint32_t>::max())
    throw Error("{}: {} points: LAS 1.2 holds fewer than 2^32", file.string(), points.size());
  CheckFinite(file, points);
  const Grid grid = GridOf(file, points);
  AtomicFile output(file);
  ByteWriter bytes;
  PutHeader(static_cast<uint32_t>(points.size()), grid, BoundsOf(points, grid), epsg.has_value(),
            &bytes);
  if (epsg) PutSystem(*epsg, &bytes);
  output.Write(bytes.bytes());
  for (const ColouredPoint& point : points) {
    bytes.Clear();
    PutPoint(point, grid, &bytes);
    output.Write(bytes.bytes());
  }
  output.Commit();
}

}  // namespace deepuav
