#include "deepuav/features/dot_kernels.h"

#include <algorithm>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace deepuav {
namespace {

int32_t PortableDot(const int8_t* a, const int8_t* b, int dimension) {
  int32_t sum = 0;
  for (int k = 0; k < dimension; ++k) sum += int32_t{a[k]} * int32_t{b[k]};
  return sum;
}

inline float Scaled(int32_t dot, float scale_a, float scale_b) {
  return static_cast<float>(dot) * (scale_a * scale_b);
}

void PortableMatrix(const ScaledRows& a, const ScaledRows& b, int dimension, float* out) {
  for (ptrdiff_t i = 0; i < a.rows; ++i) {
    for (ptrdiff_t j = 0; j < b.rows; ++j) {
      const int32_t dot =
          PortableDot(a.values + i * dimension, b.values + j * dimension, dimension);
      *out++ = Scaled(dot, a.scales[i], b.scales[j]);
    }
  }
}

#if defined(__x86_64__)

constexpr int kAvx2Step = 32;

__attribute__((target("avx2"))) inline int32_t SumOfLanes(__m256i v) {
  __m128i sum = _mm_add_epi32(_mm256_castsi256_si128(v), _mm256_extracti128_si256(v, 1));
  sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, _MM_SHUFFLE(1, 0, 3, 2)));
  sum = _mm_add_epi32(sum, _mm_shuffle_epi32(sum, _MM_SHUFFLE(2, 3, 0, 1)));
  return _mm_cvtsi128_si32(sum);
}

/// The eight partial sums of 32 products: |a| * (b with a's sign), whose pairs stay below 2^15.
__attribute__((target("avx2"))) inline __m256i Products(__m256i a, __m256i a_magnitude,
                                                        const int8_t* b) {
  const __m256i signed_b =
      _mm256_sign_epi8(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(b)), a);
  return _mm256_madd_epi16(_mm256_maddubs_epi16(a_magnitude, signed_b), _mm256_set1_epi16(1));
}

__attribute__((target("avx2"))) int32_t Avx2Dot(const int8_t* a, const int8_t* b, int dimension) {
  __m256i sum = _mm256_setzero_si256();
  int k = 0;
  for (; k + kAvx2Step <= dimension; k += kAvx2Step) {
    const __m256i a_values = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(a + k));
    sum = _mm256_add_epi32(sum, Products(a_values, _mm256_abs_epi8(a_values), b + k));
  }
  return SumOfLanes(sum) + PortableDot(a + k, b + k, dimension - k);
}

/// One row of a against four of b, which share the loads of a.
__attribute__((target("avx2"))) void Avx2DotFour(const int8_t* a, const int8_t* b, int dimension,
                                                 int32_t* out) {
  __m256i sums[4] = {_mm256_setzero_si256(), _mm256_setzero_si256(), _mm256_setzero_si256(),
                     _mm256_setzero_si256()};
  int k = 0;
  for (; k + kAvx2Step <= dimension; k += kAvx2Step) {
    const __m256i a_values = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(a + k));
    const __m256i a_magnitude = _mm256_abs_epi8(a_values);
    for (ptrdiff_t row = 0; row < 4; ++row) {
      sums[row] =
          _mm256_add_epi32(sums[row], Products(a_values, a_magnitude, b + row * dimension + k));
    }
  }
  for (ptrdiff_t row = 0; row < 4; ++row) {
    out[row] = SumOfLanes(sums[row]) + PortableDot(a + k, b + row * dimension + k, dimension - k);
  }
}

__attribute__((target("avx2"))) void Avx2Matrix(const ScaledRows& a, const ScaledRows& b,
                                                int dimension, float* out) {
  constexpr ptrdiff_t kBlockRows = 64;  // of b, which stay in the first-level cache
  for (ptrdiff_t block = 0; block < b.rows; block += kBlockRows) {
    const ptrdiff_t end = std::min<ptrdiff_t>(b.rows, block + kBlockRows);
    for (ptrdiff_t i = 0; i < a.rows; ++i) {
      const int8_t* a_row = a.values + i * dimension;
      int32_t dots[kBlockRows];
      ptrdiff_t j = block;
      for (; j + 4 <= end; j += 4)
        Avx2DotFour(a_row, b.values + j * dimension, dimension, dots + (j - block));
      for (; j < end; ++j) dots[j - block] = Avx2Dot(a_row, b.values + j * dimension, dimension);
      for (j = block; j < end; ++j)
        out[i * b.rows + j] = Scaled(dots[j - block], a.scales[i], b.scales[j]);
    }
  }
}

#define DEEPUAV_VNNI __attribute__((target("avx512f,avx512bw,avx512vl,avx512vnni")))

constexpr int kGroup = 4;       // 8-bit products that one instruction adds into one 32-bit lane
constexpr int kPanelRows = 16;  // rows of b in one register, a lane each
constexpr int kTileRows = 8;    // rows of a that share the loads of b

/// Panels of 16 rows of b: for each group of four values of a row, the sixteen rows' groups one
/// after the other. The instruction multiplies unsigned by signed, so 128 is added to b. Rows and
/// values beyond the matrix are zero.
std::vector<uint8_t> PackPanels(const int8_t* b, int b_rows, int dimension) {
  const ptrdiff_t groups = (dimension + kGroup - 1) / kGroup;
  const ptrdiff_t panels = (b_rows + kPanelRows - 1) / kPanelRows;
  std::vector<uint8_t> packed(static_cast<size_t>(panels * groups * kPanelRows * kGroup), 128);
  for (ptrdiff_t j = 0; j < b_rows; ++j) {
    uint8_t* out = packed.data() + (j / kPanelRows * groups * kPanelRows + j % kPanelRows) * kGroup;
    const int8_t* row = b + j * dimension;
    ptrdiff_t k = 0;
    for (; k + kGroup <= dimension; k += kGroup, out += kPanelRows * kGroup) {
      uint32_t group;
      std::memcpy(&group, row + k, kGroup);
      group ^= 0x80808080U;  // Adds 128 to each byte.
      std::memcpy(out, &group, kGroup);
    }
    for (; k < dimension; ++k) out[k % kGroup] = static_cast<uint8_t>(row[k] + 128);
  }
  return packed;
}

/// Rows of whole groups.
std::vector<int8_t> PadRows(const int8_t* a, int a_rows, int dimension, ptrdiff_t padded) {
  std::vector<int8_t> rows(static_cast<size_t>(a_rows * padded));
  for (ptrdiff_t i = 0; i < a_rows; ++i)
    std::copy_n(a + i * dimension, dimension, rows.data() + i * padded);
  return rows;
}

/// What adding 128 to b adds to the dot products of each row of a.
std::vector<int32_t> UnsignedOffsets(const int8_t* a, int rows, ptrdiff_t dimension) {
  std::vector<int32_t> offsets(static_cast<size_t>(rows));
  for (int32_t& offset : offsets) {
    for (ptrdiff_t k = 0; k < dimension; ++k) offset += a[k];
    offset *= 128;
    a += dimension;
  }
  return offsets;
}

/// `Rows` rows of a against two panels of b, of which `columns` rows exist.
template <int Rows>
DEEPUAV_VNNI void VnniTile(const int8_t* a, const float* a_scales, const int32_t* a_offsets,
                           ptrdiff_t padded, const uint8_t* panel, const uint8_t* next_panel,
                           const float* b_scales, ptrdiff_t columns, float* out,
                           ptrdiff_t out_stride) {
  __m512i sums[Rows][2];
  for (int i = 0; i < Rows; ++i) sums[i][0] = sums[i][1] = _mm512_setzero_si512();
  for (ptrdiff_t k = 0; k < padded; k += kGroup) {
    const __m512i b0 = _mm512_loadu_si512(panel + k * kPanelRows);
    const __m512i b1 = _mm512_loadu_si512(next_panel + k * kPanelRows);
    for (ptrdiff_t i = 0; i < Rows; ++i) {
      int32_t group;
      std::memcpy(&group, a + i * padded + k, sizeof group);
      const __m512i a_group = _mm512_set1_epi32(group);
      sums[i][0] = _mm512_dpbusd_epi32(sums[i][0], b0, a_group);
      sums[i][1] = _mm512_dpbusd_epi32(sums[i][1], b1, a_group);
    }
  }
  for (ptrdiff_t half = 0; half < 2 && columns > half * kPanelRows; ++half) {
    const auto count = std::min<ptrdiff_t>(kPanelRows, columns - half * kPanelRows);
    const auto mask = static_cast<__mmask16>((1u << count) - 1);
    const __m512 b_scale = _mm512_maskz_loadu_ps(mask, b_scales + half * kPanelRows);
    for (ptrdiff_t i = 0; i < Rows; ++i) {
      const __m512i dots = _mm512_sub_epi32(sums[i][half], _mm512_set1_epi32(a_offsets[i]));
      const __m512 scale = _mm512_mul_ps(_mm512_set1_ps(a_scales[i]), b_scale);
      _mm512_mask_storeu_ps(out + i * out_stride + half * kPanelRows, mask,
                            _mm512_mul_ps(_mm512_maskz_cvtepi32_ps(mask, dots), scale));
    }
  }
}

DEEPUAV_VNNI void VnniMatrix(const ScaledRows& a, const ScaledRows& b, int dimension, float* out) {
  const ptrdiff_t padded = (dimension + kGroup - 1) / kGroup * kGroup;
  const std::vector<uint8_t> panels = PackPanels(b.values, b.rows, dimension);
  std::vector<int8_t> padded_a;
  if (padded != dimension) padded_a = PadRows(a.values, a.rows, dimension, padded);
  const int8_t* a_values = padded_a.empty() ? a.values : padded_a.data();

  const std::vector<int32_t> offsets = UnsignedOffsets(a_values, a.rows, padded);

  for (ptrdiff_t j = 0; j < b.rows; j += 2 * kPanelRows) {
    const ptrdiff_t columns = std::min<ptrdiff_t>(b.rows - j, 2 * kPanelRows);
    const uint8_t* panel = panels.data() + j * padded;
    // A lone last panel is multiplied twice rather than reading beyond the end.
    const uint8_t* next_panel = columns > kPanelRows ? panel + kPanelRows * padded : panel;
    ptrdiff_t i = 0;
    for (; i + kTileRows <= a.rows; i += kTileRows) {
      VnniTile<kTileRows>(a_values + i * padded, a.scales + i, offsets.data() + i, padded, panel,
                          next_panel, b.scales + j, columns, out + i * b.rows + j, b.rows);
    }
    for (; i < a.rows; ++i) {
      VnniTile<1>(a_values + i * padded, a.scales + i, offsets.data() + i, padded, panel,
                  next_panel, b.scales + j, columns, out + i * b.rows + j, b.rows);
    }
  }
}

#endif

std::vector<DotKernels> FindKernels() {
  std::vector<DotKernels> kernels{{"portable", PortableDot, PortableMatrix}};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) kernels.push_back({"avx2", Avx2Dot, Avx2Matrix});
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("avx512f") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512vnni")) {
    kernels.push_back({"avx512_vnni", Avx2Dot, VnniMatrix});
  }
#endif
  return kernels;
}

}  // namespace

const std::vector<DotKernels>& AvailableDotKernels() {
  static const std::vector<DotKernels> kernels = FindKernels();
  return kernels;
}

}  // namespace deepuav
