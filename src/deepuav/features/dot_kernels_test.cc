#include "deepuav/features/dot_kernels.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

struct Rows {
  std::vector<int8_t> values;
  std::vector<float> scales;

  ScaledRows View() const {
    return {values.data(), scales.data(), static_cast<int>(scales.size())};
  }
};

Rows RandomRows(int rows, int dimension, Random* random) {
  Rows made;
  for (int i = 0; i < rows * dimension; ++i)
    made.values.push_back(static_cast<int8_t>(random->Index(255) - 127));
  for (int i = 0; i < rows; ++i)
    made.scales.push_back(static_cast<float>(random->Uniform(0.001, 0.01)));
  return made;
}

TEST(DotKernels, PortableIsTheSum) {
  const std::vector<int8_t> a{1, -2, 127, -127}, b{3, 5, 127, 127};
  EXPECT_EQ(AvailableDotKernels().front().dot(a.data(), b.data(), 4), 3 - 10);
  EXPECT_EQ(AvailableDotKernels().front().dot(a.data(), b.data(), 3), 3 - 10 + 127 * 127);
}

TEST(DotKernels, AllGiveTheSameBits) {
  Random random(1);
  const DotKernels& portable = AvailableDotKernels().front();
  for (const int dimension : {1, 3, 4, 31, 32, 64, 65, 128, 250, 256}) {
    for (const auto& [a_rows, b_rows] :
         {std::pair{1, 1}, {7, 15}, {8, 16}, {9, 17}, {20, 33}, {33, 131}}) {
      const Rows a = RandomRows(a_rows, dimension, &random),
                 b = RandomRows(b_rows, dimension, &random);
      const auto size = static_cast<size_t>(a_rows * b_rows);
      std::vector<float> expected(size);
      portable.matrix(a.View(), b.View(), dimension, expected.data());
      for (const DotKernels& kernels : AvailableDotKernels()) {
        // One element more shows writing beyond the end.
        std::vector<float> out(size + 1, -7.0f);
        kernels.matrix(a.View(), b.View(), dimension, out.data());
        EXPECT_EQ(out.back(), -7.0f) << kernels.name;
        out.pop_back();
        EXPECT_EQ(out, expected) << kernels.name << " " << dimension << " " << a_rows << " "
                                 << b_rows;
        EXPECT_EQ(kernels.dot(a.values.data(), b.values.data(), dimension),
                  portable.dot(a.values.data(), b.values.data(), dimension))
            << kernels.name;
      }
    }
  }
}

TEST(DotKernels, LargestValuesDoNotSaturate) {
  constexpr int kDimension = 256;
  const Rows positive{std::vector<int8_t>(kDimension, 127), {1.0f}};
  const Rows negative{std::vector<int8_t>(kDimension, -127), {1.0f}};
  for (const DotKernels& kernels : AvailableDotKernels()) {
    float out = 0;
    kernels.matrix(positive.View(), positive.View(), kDimension, &out);
    EXPECT_EQ(out, 127.0f * 127 * kDimension) << kernels.name;
    kernels.matrix(negative.View(), negative.View(), kDimension, &out);
    EXPECT_EQ(out, 127.0f * 127 * kDimension) << kernels.name;
    kernels.matrix(positive.View(), negative.View(), kDimension, &out);
    EXPECT_EQ(out, -127.0f * 127 * kDimension) << kernels.name;
    EXPECT_EQ(kernels.dot(positive.values.data(), negative.values.data(), kDimension),
              -127 * 127 * kDimension);
  }
}

TEST(DotKernels, NoRowsGiveNothing) {
  Random random(2);
  const Rows some = RandomRows(3, 64, &random), none;
  for (const DotKernels& kernels : AvailableDotKernels()) {
    float out = -7;
    kernels.matrix(some.View(), none.View(), 64, &out);
    kernels.matrix(none.View(), some.View(), 64, &out);
    EXPECT_EQ(out, -7) << kernels.name;
  }
}

}  // namespace
}  // namespace deepuav
