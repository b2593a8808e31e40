#include "deepuav/features/superpoint_postprocessing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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

}  // namespace
}  // namespace deepuav
