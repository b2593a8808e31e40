#include "deepuav/features/superpoint_postprocessing.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr float kLowestExponent = -80.0f;

/// exp(x) for x in [kLowestExponent, 0], to 3e-7 of itself. Written so that compilers vectorise it:
/// 2^n by the exponent's bits times the Taylor polynomial of 2^f, |f| <= 0.5.
inline float FastExp(float x) {
  constexpr float kLog2E = 1.44269504f;
  constexpr float kLn2High = 0.693359375f,
                  kLn2Low = -2.12194440e-4f;      // Cody and Waite's two parts of ln 2
  constexpr float kRoundToInteger = 12582912.0f;  // 1.5 * 2^23
  const float shifted = x * kLog2E + kRoundToInteger;
  const float n = shifted - kRoundToInteger;
  const float r = (x - n * kLn2High) - n * kLn2Low;
  float p = 1.0f / 720;
  p = p * r + 1.0f / 120;
  p = p * r + 1.0f / 24;
  p = p * r + 1.0f / 6;
  p = p * r + 0.5f;
  p = p * r + 1.0f;
  p = p * r + 1.0f;
  const uint32_t exponent =
      (std::bit_cast<uint32_t>(shifted) - std::bit_cast<uint32_t>(kRoundToInteger)) << 23;
  return std::bit_cast<float>(std::bit_cast<uint32_t>(p) + exponent);
}

constexpr size_t kBins = kSuperPointCell * kSuperPointCell;  ///< Of a cell with a point.
constexpr size_t kLanes = 16;
static_assert(kBins % kLanes == 0 && kSuperPointLogits == kBins + 1);

float Largest(const float* logits) {
  std::array<float, kLanes> lanes;
  std::copy_n(logits, kLanes, lanes.begin());
  float* largest = lanes.data();
  for (size_t i = kLanes; i < kBins; i += kLanes) {
    const float* values = logits + i;
    for (size_t k = 0; k < kLanes; ++k)
      largest[k] = largest[k] < values[k] ? values[k] : largest[k];
  }
  return std::max(*std::max_element(lanes.begin(), lanes.end()), logits[kBins]);
}

/// Exponentials of a row of cells, relative to each cell's largest: `exponentials` [columns, 65].
void RowExponentials(const float* logits, int columns, float* exponentials) {
  std::array<float, kLanes> partial{};  // 0 unless a value is infinite or NaN
  for (int x = 0; x < columns;
       ++x, logits += kSuperPointLogits, exponentials += kSuperPointLogits) {
    const float largest = Largest(logits);
    // Two loops: with the bound in one of them, compilers vectorise none.
    for (int i = 0; i < kSuperPointLogits; ++i) {
      const float exponent = logits[i] - largest;
      exponentials[i] = exponent < kLowestExponent ? kLowestExponent : exponent;
    }
    for (int i = 0; i < kSuperPointLogits; ++i) exponentials[i] = FastExp(exponentials[i]);
    for (size_t i = 0; i < kBins; ++i) partial[i % kLanes] += logits[i] * 0.0f;
    partial[0] += logits[kBins] * 0.0f;
  }
  for (const float value : partial) {
    if (value != 0) throw Error("the detector's logits have a value that is not finite");
  }
}

/// The inverse of the sum of each cell's exponentials [columns, 65]; several cells in turns, as one
/// addition waits for the one before.
void InverseSums(const float* exponentials, int columns, float* inverse_sums) {
  constexpr int kAtOnce = 8;
  for (int x = 0; x < columns; x += kAtOnce) {
    const int count = std::min(kAtOnce, columns - x);
    std::array<float, kAtOnce> sums{};
    const float* first = exponentials + static_cast<ptrdiff_t>(x) * kSuperPointLogits;
    for (int i = 0; i < kSuperPointLogits; ++i) {
      for (int k = 0; k < count; ++k)
        sums[static_cast<size_t>(k)] += first[k * kSuperPointLogits + i];
    }
    for (int k = 0; k < count; ++k) inverse_sums[x + k] = 1.0f / sums[static_cast<size_t>(k)];
  }
}

bool AllBelow(const float* row, int begin, int end, float score) {
  for (int x = begin; x < end; ++x) {
    if (row[x] >= score) return false;
  }
  return true;
}

bool NoneAbove(const float* row, int begin, int end, float score) {
  for (int x = begin; x < end; ++x) {
    if (row[x] > score) return false;
  }
  return true;
}

bool IsMaximum(const HeatMap& map, int x, int y, int radius) {
  const float score = map.Row(y)[x];
  const int left = std::max(0, x - radius), right = std::min(map.width, x + radius + 1);
  if (!AllBelow(map.Row(y), left, x, score) || !NoneAbove(map.Row(y), x + 1, right, score))
    return false;
  for (int distance = 1; distance <= radius; ++distance) {
    if (y - distance >= 0 && !AllBelow(map.Row(y - distance), left, right, score)) return false;
    if (y + distance < map.height && !NoneAbove(map.Row(y + distance), left, right, score))
      return false;
  }
  return true;
}

/// Weights of the four neighbours around a position `fraction` in [0, 1) after the second, by cubic
/// convolution (Keys 1981, equations 3 and 4 with a = -3/4 as in training frameworks: matched
/// better than a = -1/2 and than linear).
std::array<float, 4> CubicWeights(float fraction) {
  constexpr float a = -0.75f;
  const auto near = [](float x) { return ((a + 2) * x - (a + 3)) * x * x + 1; };  // |x| <= 1
  const auto far = [](float x) {
    return ((a * x - 5 * a) * x + 8 * a) * x - 4 * a;
  };  // 1 < |x| < 2
  return {far(1 + fraction), near(fraction), near(1 - fraction), far(2 - fraction)};
}

}  // namespace

void LogitsToHeatMap(std::span<const float> logits, int rows, int columns,
                     std::span<float> heat_map, std::vector<float>* scratch) {
  const size_t cells = static_cast<size_t>(rows) * static_cast<size_t>(columns);
  if (logits.size() != cells * kSuperPointLogits ||
      heat_map.size() != cells * kSuperPointCell * kSuperPointCell) {
    throw Error("{} logits for a heat map of {} pixels: expected {} and {} for {}x{} cells",
                logits.size(), heat_map.size(), cells * kSuperPointLogits,
                cells * kSuperPointCell * kSuperPointCell, columns, rows);
  }
  const auto width = static_cast<size_t>(columns);
  scratch->resize(width * (kSuperPointLogits + 1));
  float* exponentials = scratch->data();
  float* inverse_sums = exponentials + width * kSuperPointLogits;
  for (int row = 0; row < rows; ++row) {
    RowExponentials(logits.data() + static_cast<size_t>(row) * width * kSuperPointLogits, columns,
                    exponentials);
    InverseSums(exponentials, columns, inverse_sums);
    for (int dy = 0; dy < kSuperPointCell; ++dy) {
      const float* bins = exponentials + dy * kSuperPointCell;
      float* out = heat_map.data() +
                   static_cast<size_t>(row * kSuperPointCell + dy) * width * kSuperPointCell;
      for (int x = 0; x < columns; ++x, bins += kSuperPointLogits, out += kSuperPointCell) {
        for (int dx = 0; dx < kSuperPointCell; ++dx) out[dx] = bins[dx] * inverse_sums[x];
      }
    }
  }
}

void CheckFinite(const HeatMap& heat_map) {
  for (int y = 0; y < heat_map.height; ++y) {
    const float* row = heat_map.Row(y);
    std::array<float, 8> partial{};
    for (int x = 0; x < heat_map.width; ++x) partial[static_cast<size_t>(x % 8)] += row[x] * 0.0f;
    for (const float value : partial) {
      if (value != 0) throw Error("the detector's heat map has a value that is not finite");
    }
  }
}

std::vector<Peak> FindPeaks(const HeatMap& heat_map, const PeakOptions& options) {
  const float least = options.faint_count > 0 ? std::min(options.threshold, options.faint_threshold)
                                              : options.threshold;
  std::vector<Peak> peaks;
  for (int y = options.border; y < heat_map.height - options.border; ++y) {
    const float* row = heat_map.Row(y);
    for (int x = options.border; x < heat_map.width - options.border; ++x) {
      if (row[x] > least && IsMaximum(heat_map, x, y, options.radius))
        peaks.push_back({x, y, row[x]});
    }
  }
  const auto better = [](const Peak& a, const Peak& b) {
    if (a.score != b.score) return a.score > b.score;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  };
  const auto kept =
      static_cast<ptrdiff_t>(std::min(peaks.size(), static_cast<size_t>(options.count)));
  std::partial_sort(peaks.begin(), peaks.begin() + kept, peaks.end(), better);
  peaks.resize(static_cast<size_t>(kept));
  while (static_cast<int>(peaks.size()) > options.faint_count &&
         peaks.back().score <= options.threshold)
    peaks.pop_back();
  return peaks;
}

PeakRefiner::PeakRefiner(double sigma_px, double max_offset_px)
    : max_offset_px_(static_cast<float>(max_offset_px)) {
  const int radius = static_cast<int>(std::ceil(3 * sigma_px));
  for (int i = -radius; i <= radius; ++i) {
    const double distance = i == 0 ? 0 : i / sigma_px;
    kernel_.push_back(static_cast<float>(std::exp(-0.5 * distance * distance)));
  }
}

/// Entry (row, column) belongs to the pixel (column - 1, row - 1) from the peak. The kernel is not
/// normalised: that only adds a constant.
Eigen::Matrix3f PeakRefiner::SmoothedLogarithm(const HeatMap& heat_map, const Peak& peak) const {
  const int radius = static_cast<int>(kernel_.size()) / 2;
  Eigen::Matrix3f smoothed = Eigen::Matrix3f::Zero();
  for (int dy = -radius - 1; dy <= radius + 1; ++dy) {
    const float* row = heat_map.Row(std::clamp(peak.y + dy, 0, heat_map.height - 1));
    Eigen::RowVector3f along_row = Eigen::RowVector3f::Zero();
    for (int dx = -radius - 1; dx <= radius + 1; ++dx) {
      const float value = row[std::clamp(peak.x + dx, 0, heat_map.width - 1)];
      for (int column = 0; column < 3; ++column) {
        const int k = dx - (column - 1) + radius;
        if (k >= 0 && k <= 2 * radius) along_row[column] += kernel_[static_cast<size_t>(k)] * value;
      }
    }
    for (int i = 0; i < 3; ++i) {
      const int k = dy - (i - 1) + radius;
      if (k >= 0 && k <= 2 * radius) smoothed.row(i) += kernel_[static_cast<size_t>(k)] * along_row;
    }
  }
  return smoothed.cwiseMax(std::numeric_limits<float>::min()).array().log();
}

Eigen::Vector2f PeakRefiner::Refine(const HeatMap& heat_map, const Peak& peak) const {
  const Eigen::Matrix3f log = SmoothedLogarithm(heat_map, peak);
  const Eigen::RowVector3f columns = log.colwise().sum();
  const Eigen::Vector3f rows = log.rowwise().sum();
  const Eigen::Vector2f gradient((columns[2] - columns[0]) / 6, (rows[2] - rows[0]) / 6);
  Eigen::Matrix2f hessian;
  hessian(0, 0) = (columns[0] - 2 * columns[1] + columns[2]) / 3;
  hessian(1, 1) = (rows[0] - 2 * rows[1] + rows[2]) / 3;
  hessian(0, 1) = hessian(1, 0) = (log(0, 0) + log(2, 2) - log(0, 2) - log(2, 0)) / 4;

  Eigen::Vector2f offset = Eigen::Vector2f::Zero();
  if (hessian(0, 0) < 0 && hessian.determinant() > 0) {
    offset = (-hessian.inverse() * gradient).cwiseMax(-max_offset_px_).cwiseMin(max_offset_px_);
  }
  return Eigen::Vector2f(static_cast<float>(peak.x), static_cast<float>(peak.y)) + offset;
}

void InverseLengths(std::span<const float> descriptors, std::span<float> inverse_lengths) {
  const size_t dimension = descriptors.size() / std::max<size_t>(inverse_lengths.size(), 1);
  for (size_t cell = 0; cell < inverse_lengths.size(); ++cell) {
    std::array<float, kLanes> lanes{};
    float* sums = lanes.data();
    const float* values = descriptors.data() + cell * dimension;
    size_t i = 0;
    for (; i + kLanes <= dimension; i += kLanes) {
      for (size_t k = 0; k < kLanes; ++k) sums[k] += values[i + k] * values[i + k];
    }
    for (; i < dimension; ++i) sums[0] += values[i] * values[i];
    const float squared = std::accumulate(lanes.begin(), lanes.end(), 0.0f);
    inverse_lengths[cell] = squared == 0 ? 0.0f : 1.0f / std::sqrt(squared);
  }
}

void SampleDescriptor(const DescriptorMap& map, const Eigen::Vector2f& px,
                      std::span<float> descriptor) {
  constexpr float kFirstCentre = 0.5f * (kSuperPointCell - 1);
  const Eigen::Vector2f cell = (px.array() - kFirstCentre) / kSuperPointCell;
  const Eigen::Vector2f corner = cell.array().floor();
  const auto weights_x = CubicWeights(cell.x() - corner.x()),
             weights_y = CubicWeights(cell.y() - corner.y());
  const auto dimension = static_cast<size_t>(map.dimension);

  std::fill(descriptor.begin(), descriptor.end(), 0.0f);
  for (int j = 0; j < 4; ++j) {
    const int row = std::clamp(static_cast<int>(corner.y()) - 1 + j, 0, map.rows - 1);
    std::array<const float*, 4> cells;
    std::array<float, 4> weights;
    for (int i = 0; i < 4; ++i) {
      const int column = std::clamp(static_cast<int>(corner.x()) - 1 + i, 0, map.columns - 1);
      const auto k = static_cast<size_t>(i);
      const size_t index =
          static_cast<size_t>(row) * static_cast<size_t>(map.columns) + static_cast<size_t>(column);
      cells[k] = map.values + index * dimension;
      weights[k] = weights_x[k] * weights_y[static_cast<size_t>(j)] * map.inverse_lengths[index];
    }
    const float *a = cells[0], *b = cells[1], *c = cells[2], *d = cells[3];
    float* out = descriptor.data();
    for (size_t k = 0; k < dimension; ++k) {
      out[k] += (weights[0] * a[k] + weights[1] * b[k]) + (weights[2] * c[k] + weights[3] * d[k]);
    }
  }
  Eigen::Map<Eigen::VectorXf> vector(descriptor.data(), static_cast<Eigen::Index>(dimension));
  const float norm = vector.norm();
  if (!std::isfinite(norm)) throw Error("the descriptors have a value that is not finite");
  if (norm > 0) vector /= norm;
}

}  // namespace deepuav
