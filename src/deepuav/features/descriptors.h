#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace deepuav {

/// L2-normalised descriptors of one dimension, one row each, stored as 8-bit integers with a scale
/// per row: a quarter of the memory of floats, and the similarity is an integer dot product. Value
/// type; const use is thread-safe.
class Descriptors {
 public:
  explicit Descriptors(int dimension = 256) : dimension_(dimension) {}

  /// Restores what stored_values() and scales() gave. Throws Error where the sizes do not agree,
  /// for the value -128, which never occurs, and for a scale negative or not finite.
  static Descriptors FromStored(int dimension, std::vector<int8_t> values,
                                std::vector<float> scales);

  int size() const { return static_cast<int>(scales_.size()); }
  int dimension() const { return dimension_; }
  void Reserve(int rows);

  /// Appends one L2-normalised row of `dimension` floats. Throws Error for another length or values
  /// not finite.
  void Append(std::span<const float> row);
  /// Appends row `index` of `other`, of the same dimension.
  void AppendFrom(const Descriptors& other, int index);

  /// Row `index` as floats, into `row` of length `dimension`.
  void Read(int index, std::span<float> row) const;

  /// Cosine similarity of row i here and row j of `other`, in [-1, 1] but for rounding (below
  /// 0.005).
  float Similarity(int i, const Descriptors& other, int j) const;

  /// All similarities, row-major: out[i * other.size() + j]. `out` has size() * other.size()
  /// elements.
  void SimilarityMatrix(const Descriptors& other, std::span<float> out) const;

  /// Row-major, size() x dimension(), in -127..127; row i times scales()[i] is descriptor i.
  std::span<const int8_t> stored_values() const { return values_; }
  std::span<const float> scales() const { return scales_; }

 private:
  int dimension_;
  std::vector<int8_t> values_;  ///< size() * dimension
  std::vector<float> scales_;   ///< value = scale * stored
};

}  // namespace deepuav
