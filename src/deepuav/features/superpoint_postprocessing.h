#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace deepuav {

/// Pixels per cell of the detector's and the descriptors' maps, on a side.
inline constexpr int kSuperPointCell = 8;
/// Channels of the detector: the cell's pixels, row-major, and "no point".
inline constexpr int kSuperPointLogits = kSuperPointCell * kSuperPointCell + 1;

/// A row-major map of detection probabilities. `stride` >= width is the distance between rows.
struct HeatMap {
  const float* values = nullptr;
  int width = 0, height = 0, stride = 0;

  const float* Row(int y) const { return values + static_cast<ptrdiff_t>(y) * stride; }
};

/// The softmax over the channels of `logits` [rows, columns, 65] without the "no point" bin, as a
/// map of 8 rows x 8 columns pixels (DeTone et al., SuperPoint, 2018, section 3.3). `scratch` is
/// kept to avoid allocation. Throws Error for values that are not finite.
void LogitsToHeatMap(std::span<const float> logits, int rows, int columns,
                     std::span<float> heat_map, std::vector<float>* scratch);

/// Throws Error when a value of the map is not finite.
void CheckFinite(const HeatMap& heat_map);

struct Peak {
  int x = 0, y = 0;  ///< px
  float score = 0;

  bool operator==(const Peak&) const = default;
};

struct PeakOptions {
  int count = 1000;          ///< At most so many, the best.
  float threshold = 0.005f;  ///< Scores must be above.
  int radius = 4;  ///< px; a peak is the maximum of the square of 2 radius + 1 pixels around it.
  int border = 4;  ///< px without peaks along the image's edges; they still suppress.
  int faint_count = 0;             ///< Where fewer pass the threshold, as many are taken...
  float faint_threshold = 0.001f;  ///< ...whose scores are above this.
};

/// The best peaks by falling score. Of equal scores the pixel of lower row-major index comes first,
/// and suppresses the other.
std::vector<Peak> FindPeaks(const HeatMap& heat_map, const PeakOptions& options);

/// Finds maxima between pixels: that of the quadratic fitted by least squares to the 3x3
/// neighbourhood in the logarithm of the map smoothed by a Gaussian. Exact for peaks that are
/// Gaussian themselves.
class PeakRefiner {
 public:
  /// `sigma_px` >= 0 of the smoothing; `max_offset_px` limits each coordinate's correction.
  PeakRefiner(double sigma_px, double max_offset_px);

  /// The peak's position; its pixel's centre where the neighbourhood has no maximum.
  Eigen::Vector2f Refine(const HeatMap& heat_map, const Peak& peak) const;

 private:
  Eigen::Matrix3f SmoothedLogarithm(const HeatMap& heat_map, const Peak& peak) const;

  std::vector<float> kernel_;
  float max_offset_px_;
};

/// Descriptors at every cell, [rows, columns, dimension], and what brings each to length 1.
struct DescriptorMap {
  const float* values = nullptr;
  const float* inverse_lengths = nullptr;  ///< [rows, columns]
  int rows = 0, columns = 0, dimension = 0;
};

/// 1 / length of each descriptor [cells, dimension], 0 for one of length 0. Cheaper here than in
/// the network, which writes all of them once more.
void InverseLengths(std::span<const float> descriptors, std::span<float> inverse_lengths);

/// The descriptor of length 1 at `px`, bicubically interpolated (Keys 1981) from those of length 1:
/// cell (0, 0) has its centre at pixel (3.5, 3.5); the outermost cells continue beyond the map.
/// Throws Error for values that are not finite.
void SampleDescriptor(const DescriptorMap& map, const Eigen::Vector2f& px,
                      std::span<float> descriptor);

}  // namespace deepuav
