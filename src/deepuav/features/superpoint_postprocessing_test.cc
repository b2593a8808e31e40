#include "deepuav/features/superpoint_postprocessing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct Map {
  Map(int map_width, int map_height, float value = 0)
      : width(map_width),
        height(map_height),
        values(static_cast<size_t>(map_width * map_height), value) {}

  float& operator()(int x, int y) { return values[static_cast<size_t>(y * width + x)]; }
  HeatMap View() const { return {values.data(), width, height, width}; }

  int width, height;
  std::vector<float> values;
};

std::vector<float> RandomLogits(int rows, int columns, double largest, uint64_t seed) {
  Random random(seed);
  std::vector<float> logits(static_cast<size_t>(kSuperPointLogits * rows * columns));
  for (float& value : logits) value = static_cast<float>(random.Uniform(-largest, largest));
  return logits;
}

TEST(LogitsToHeatMap, IsTheSoftmaxOfEachCell) {
  constexpr int kRows = 5, kColumns = 13;
  for (const double largest : {1.0, 20.0, 60.0}) {
    const auto logits = RandomLogits(kRows, kColumns, largest, 1);
    std::vector<float> map(kRows * kColumns * 64), scratch;
    LogitsToHeatMap(logits, kRows, kColumns, map, &scratch);
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const auto logit = [&](int channel) {
          return double{
              logits[static_cast<size_t>((row * kColumns + column) * kSuperPointLogits + channel)]};
        };
        double sum = 0;
        for (int channel = 0; channel < kSuperPointLogits; ++channel)
          sum += std::exp(logit(channel));
        for (int channel = 0; channel < 64; ++channel) {
          const int x = 8 * column + channel % 8, y = 8 * row + channel / 8;
          const double expected = std::exp(logit(channel)) / sum;
          EXPECT_NEAR(map[static_cast<size_t>(y * 8 * kColumns + x)], expected,
                      1e-5 * expected + 1e-30);
        }
      }
    }
  }
}

TEST(LogitsToHeatMap, ValuesThatAreNotFiniteAreRefused) {
  std::vector<float> map(2 * 3 * 64), scratch;
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity()}) {
    for (const size_t place : {size_t{0}, size_t{64 * 6}, size_t{65 * 6 - 1}}) {
      auto logits = RandomLogits(2, 3, 5, 2);
      logits[place] = bad;
      EXPECT_THROW(LogitsToHeatMap(logits, 2, 3, map, &scratch), Error);
    }
  }
}

TEST(LogitsToHeatMap, OtherSizesAreRefused) {
  std::vector<float> map(2 * 3 * 64), scratch;
  EXPECT_THROW(LogitsToHeatMap(RandomLogits(2, 4, 5, 2), 2, 3, map, &scratch), Error);
  map.pop_back();
  EXPECT_THROW(LogitsToHeatMap(RandomLogits(2, 3, 5, 2), 2, 3, map, &scratch), Error);
}

TEST(CheckFinite, LooksOnlyInsideTheWidth) {
  Map map(20, 6, 0.1f);
  map(19, 5) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(CheckFinite(map.View()), Error);
  HeatMap narrow = map.View();
  narrow.width = 19;
  EXPECT_NO_THROW(CheckFinite(narrow));
}

/// The definition, pixel by pixel.
std::vector<Peak> FindPeaksByDefinition(const HeatMap& map, const PeakOptions& options) {
  std::vector<Peak> peaks;
  for (int y = options.border; y < map.height - options.border; ++y) {
    for (int x = options.border; x < map.width - options.border; ++x) {
      bool survives = map.Row(y)[x] > options.threshold;
      for (int v = std::max(0, y - options.radius);
           v <= std::min(map.height - 1, y + options.radius); ++v) {
        for (int u = std::max(0, x - options.radius);
             u <= std::min(map.width - 1, x + options.radius); ++u) {
          const bool is_earlier = v < y || (v == y && u < x);
          const float other = map.Row(v)[u], score = map.Row(y)[x];
          if (other > score || (other == score && is_earlier)) survives = false;
        }
      }
      if (survives) peaks.push_back({x, y, map.Row(y)[x]});
    }
  }
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const Peak& a, const Peak& b) { return a.score > b.score; });
  peaks.resize(std::min(peaks.size(), static_cast<size_t>(options.count)));
  return peaks;
}

TEST(FindPeaks, FollowsTheDefinitionWithManyTies) {
  Random random(3);
  size_t found = 0;
  for (const int levels : {3, 40, 100000}) {
    for (const int radius : {0, 1, 4}) {
      for (const int border : {0, 4}) {
        Map map(61, 43);
        for (float& value : map.values)
          value = static_cast<float>(random.Index(levels)) / static_cast<float>(levels);
        for (const int count : {7, 10000}) {
          const PeakOptions options{count, 0.3f, radius, border};
          const auto peaks = FindPeaks(map.View(), options);
          found += peaks.size();
          EXPECT_EQ(peaks, FindPeaksByDefinition(map.View(), options));
        }
      }
    }
  }
  EXPECT_GT(found, 1000u);
}

TEST(FindPeaks, TakesFaintOnesWhereThereAreFew) {
  Map map(60, 20);
  const std::vector<float> scores{0.9f, 0.5f, 0.02f, 0.01f, 0.004f};
  for (size_t i = 0; i < scores.size(); ++i) map(8 + 10 * static_cast<int>(i), 10) = scores[i];
  const auto found = [&](int faint_count) {
    const PeakOptions options{
        .threshold = 0.1f, .faint_count = faint_count, .faint_threshold = 0.005f};
    return FindPeaks(map.View(), options).size();
  };
  EXPECT_EQ(found(0), 2u);
  EXPECT_EQ(found(1), 2u) << "enough are sure";
  EXPECT_EQ(found(3), 3u);
  EXPECT_EQ(found(100), 4u) << "the last is too faint";
}

TEST(FindPeaks, SuppressesWithinTheRadiusOnly) {
  Map map(40, 40);
  map(10, 10) = 0.9f;
  map(14, 14) = 0.8f;  // 4 px away along both axes: suppressed
  map(15, 10) = 0.7f;  // 5 px from the first, but beside the suppressed one
  map(10, 15) = 0.6f;
  map(30, 30) = 0.5f;
  EXPECT_THAT(FindPeaks(map.View(), {}), ElementsAre(Peak{10, 10, 0.9f}, Peak{30, 30, 0.5f}));
}

TEST(FindPeaks, TiesGoToTheLowerIndex) {
  Map map(40, 40);
  map(12, 10) = map(10, 12) = map(11, 12) = 0.5f;
  map(30, 30) = map(20, 30) = 0.5f;
  EXPECT_THAT(FindPeaks(map.View(), {}),
              ElementsAre(Peak{12, 10, 0.5f}, Peak{20, 30, 0.5f}, Peak{30, 30, 0.5f}));
}

TEST(FindPeaks, BordersSuppressButGiveNothing) {
  Map map(40, 40);
  map(3, 20) = 0.9f;   // in the border
  map(5, 20) = 0.8f;   // suppressed by it
  map(35, 35) = 0.7f;  // the last pixel inside
  map(36, 10) = 0.6f;  // in the border
  EXPECT_THAT(FindPeaks(map.View(), {}), ElementsAre(Peak{35, 35, 0.7f}));
}

TEST(FindPeaks, ScoresMustExceedTheThreshold) {
  Map map(40, 40);
  map(10, 10) = 0.25f;
  map(20, 20) = std::nextafter(0.25f, 1.0f);
  PeakOptions options;
  options.threshold = 0.25f;
  EXPECT_THAT(FindPeaks(map.View(), options),
              ElementsAre(Peak{20, 20, std::nextafter(0.25f, 1.0f)}));
}

TEST(FindPeaks, IgnoresWhatLiesBeyondTheWidth) {
  Map map(48, 40);
  map(45, 20) = 0.9f;  // added to make the size a multiple of 8
  map(37, 20) = 0.5f;
  HeatMap narrow = map.View();
  narrow.width = 42;
  EXPECT_THAT(FindPeaks(narrow, {}), ElementsAre(Peak{37, 20, 0.5f}));
}

TEST(FindPeaks, NothingWhereThereIsNothing) {
  EXPECT_THAT(FindPeaks(Map(40, 40).View(), {}), IsEmpty());
  EXPECT_THAT(FindPeaks(Map(6, 6, 0.5f).View(), {}), IsEmpty());  // all border
}

void AddBlob(Map* map, double x, double y, double sigma_x, double sigma_y, double correlation) {
  for (int v = 0; v < map->height; ++v) {
    for (int u = 0; u < map->width; ++u) {
      const double dx = (u - x) / sigma_x, dy = (v - y) / sigma_y;
      const double squared =
          (dx * dx - 2 * correlation * dx * dy + dy * dy) / (1 - correlation * correlation);
      (*map)(u, v) += static_cast<float>(0.6 * std::exp(-0.5 * squared));
    }
  }
}

TEST(PeakRefiner, FindsTheCentreOfGaussians) {
  const PeakRefiner refiner(1.0, 1.0);
  Random random(4);
  double largest_error = 0;
  for (int i = 0; i < 200; ++i) {
    Map map(24, 24);
    const Eigen::Vector2d centre(12 + random.Uniform(-0.5, 0.5), 12 + random.Uniform(-0.5, 0.5));
    AddBlob(&map, centre.x(), centre.y(), random.Uniform(0.7, 2), random.Uniform(0.7, 2),
            random.Uniform(-0.5, 0.5));
    const auto peaks = FindPeaks(map.View(), {});
    ASSERT_EQ(peaks.size(), 1u);
    const Eigen::Vector2f found = refiner.Refine(map.View(), peaks[0]);
    largest_error = std::max(largest_error, (found.cast<double>() - centre).norm());
  }
  EXPECT_LT(largest_error, 0.05);
}

TEST(PeakRefiner, StandsNoise) {
  const PeakRefiner refiner(1.0, 0.5);
  Random random(5);
  double squares = 0;
  constexpr int kTrials = 300;
  for (int i = 0; i < kTrials; ++i) {
    Map map(24, 24);
    const Eigen::Vector2d centre(12 + random.Uniform(-0.4, 0.4), 12 + random.Uniform(-0.4, 0.4));
    AddBlob(&map, centre.x(), centre.y(), 1, 1, 0);
    for (float& value : map.values) value *= static_cast<float>(std::exp(random.Gaussian(0.1)));
    squares += (refiner.Refine(map.View(), {12, 12, 0.6f}).cast<double>() - centre).squaredNorm();
  }
  EXPECT_LT(std::sqrt(squares / kTrials), 0.1);
}

TEST(PeakRefiner, KeepsToItsLimitAndToThePixel) {
  Map ramp(24, 24);
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 24; ++x) ramp(x, y) = 0.01f * static_cast<float>(1 + x);
  }
  const Eigen::Vector2f on_ramp = PeakRefiner(1.0, 0.5).Refine(ramp.View(), {12, 12, 0.13f});
  EXPECT_LE(on_ramp.x(), 12.5f);
  EXPECT_GE(on_ramp.x(), 12.0f);
  EXPECT_NEAR(on_ramp.y(), 12, 1e-3);
  EXPECT_EQ(PeakRefiner(1.0, 0.5).Refine(Map(24, 24).View(), {12, 12, 0}), Eigen::Vector2f(12, 12));

  Map blob(24, 24);
  AddBlob(&blob, 12.9, 11.2, 1.5, 1.5, 0);
  const Eigen::Vector2f clamped = PeakRefiner(1.0, 0.5).Refine(blob.View(), {12, 12, 0.5f});
  EXPECT_FLOAT_EQ(clamped.x(), 12.5f);
  EXPECT_FLOAT_EQ(clamped.y(), 11.5f);
}

TEST(PeakRefiner, StaysWithinItsLimitAtTheCornersOfTheMap) {
  Map map(16, 16);
  AddBlob(&map, 0.2, 15.1, 1, 1, 0);
  const Eigen::Vector2f found = PeakRefiner(1.0, 0.5).Refine(map.View(), {0, 15, 0.6f});
  EXPECT_LE((found - Eigen::Vector2f(0, 15)).cwiseAbs().maxCoeff(), 0.5f);
}

TEST(PeakRefiner, WithoutSmoothingFitsTheMapItself) {
  Map map(24, 24);
  AddBlob(&map, 12.3, 11.8, 1.2, 1.2, 0);
  const Eigen::Vector2f found = PeakRefiner(0, 0.5).Refine(map.View(), {12, 12, 0.6f});
  EXPECT_NEAR(found.x(), 12.3, 1e-3);
  EXPECT_NEAR(found.y(), 11.8, 1e-3);
}

struct RandomCells {
  static constexpr int kRows = 6, kColumns = 9, kDimension = 20;

  RandomCells() {
    Random random(6);
    for (int i = 0; i < kRows * kColumns * kDimension; ++i) {
      values.push_back(static_cast<float>(random.Gaussian(1)));
    }
  }
  Eigen::VectorXd At(int row, int column) const {
    row = std::clamp(row, 0, kRows - 1);
    column = std::clamp(column, 0, kColumns - 1);
    return Eigen::Map<const Eigen::VectorXf>(values.data() + (row * kColumns + column) * kDimension,
                                             kDimension)
        .cast<double>();
  }

  std::vector<float> values;
};

void Sample(const RandomCells& cells, const Eigen::Vector2f& px, std::vector<float>* found) {
  std::vector<float> inverse_lengths(RandomCells::kRows * RandomCells::kColumns);
  InverseLengths(cells.values, inverse_lengths);
  found->resize(RandomCells::kDimension);
  SampleDescriptor({cells.values.data(), inverse_lengths.data(), RandomCells::kRows,
                    RandomCells::kColumns, RandomCells::kDimension},
                   px, *found);
}

Eigen::VectorXd Sample(const RandomCells& cells, const Eigen::Vector2f& px) {
  std::vector<float> found;
  Sample(cells, px, &found);
  return Eigen::Map<Eigen::VectorXf>(found.data(), RandomCells::kDimension).cast<double>();
}

TEST(SampleDescriptor, AtACentreIsTheCell) {
  const RandomCells cells;
  for (int row = 0; row < RandomCells::kRows; ++row) {
    for (int column = 0; column < RandomCells::kColumns; ++column) {
      const Eigen::Vector2f centre(8.0f * static_cast<float>(column) + 3.5f,
                                   8.0f * static_cast<float>(row) + 3.5f);
      EXPECT_LT((Sample(cells, centre) - cells.At(row, column).normalized()).norm(), 1e-6);
    }
  }
}

double KeysKernel(double x) {
  const double a = -0.75, d = std::abs(x);
  if (d <= 1) return (a + 2) * d * d * d - (a + 3) * d * d + 1;
  if (d < 2) return a * d * d * d - 5 * a * d * d + 8 * a * d - 4 * a;
  return 0;
}

TEST(SampleDescriptor, IsTheCubicConvolution) {
  const RandomCells cells;
  Random random(7);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2f px(static_cast<float>(random.Uniform(-0.5, 71.5)),
                             static_cast<float>(random.Uniform(-0.5, 47.5)));
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(RandomCells::kDimension);
    for (int row = -3; row < RandomCells::kRows + 3; ++row) {
      for (int column = -3; column < RandomCells::kColumns + 3; ++column) {
        expected += KeysKernel((px.x() - 3.5) / 8 - column) * KeysKernel((px.y() - 3.5) / 8 - row) *
                    cells.At(row, column).normalized();
      }
    }
    EXPECT_LT((Sample(cells, px) - expected.normalized()).norm(), 1e-5);
  }
}

TEST(SampleDescriptor, ZeroStaysZero) {
  RandomCells cells;
  std::fill(cells.values.begin(), cells.values.end(), 0.0f);
  EXPECT_EQ(Sample(cells, {20, 20}).norm(), 0);
}

TEST(SampleDescriptor, ValuesThatAreNotFiniteAreRefused) {
  RandomCells cells;
  cells.values[0] = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> found;
  EXPECT_THROW(Sample(cells, {4, 4}, &found), Error);
  cells.values[0] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Sample(cells, {4, 4}, &found), Error);
}

TEST(InverseLengths, BringEachDescriptorToLengthOne) {
  for (const int dimension : {3, 16, 256}) {
    Random random(8);
    std::vector<float> values(static_cast<size_t>(5 * dimension)), inverse(5);
    for (float& value : values) value = static_cast<float>(random.Gaussian(3));
    std::fill_n(values.begin() + dimension, dimension, 0.0f);
    InverseLengths(values, inverse);
    for (int cell = 0; cell < 5; ++cell) {
      const double length = Eigen::Map<Eigen::VectorXf>(values.data() + cell * dimension, dimension)
                                .cast<double>()
                                .norm();
      EXPECT_NEAR(inverse[static_cast<size_t>(cell)] * length, cell == 1 ? 0 : 1, 1e-6);
    }
  }
}

}  // namespace
}  // namespace deepuav
