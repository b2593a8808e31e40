#include "deepuav/evaluation/drawing/plot_axes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(RangeOf, HoldsTheValuesWithTheirMargin) {
  const PlotRange range = RangeOf({3, -1, 2}, 0.25);
  EXPECT_DOUBLE_EQ(range.low, -2);
  EXPECT_DOUBLE_EQ(range.high, 4);
  EXPECT_DOUBLE_EQ(RangeOf({}, 0.1).Extent(), 1);
}

TEST(RangeOf, HasAWidthWhereTheValuesHaveNone) {
  for (const double value : {0.0, -5.0, 1e6, 1e12, -1e15}) {
    const PlotRange range = RangeOf({value, value}, 0.1);
    EXPECT_LT(range.low, value) << value;
    EXPECT_GT(range.high, value) << value;
    EXPECT_NEAR(range.low + range.high, 2 * value, 1e-9 * std::abs(value));
  }
  // Nor where they differ by rounding alone.
  const double next = std::nextafter(1e6, 2e6);
  EXPECT_GE(RangeOf({1e6, next}, 0).Extent(), 1);
}

TEST(Ticks, AreRoundInsideTheRangeAndNeitherFewNorMany) {
  constexpr PlotRange kRanges[] = {{0, 1},         {-3, 7},        {0.1, 0.92},   {1e-9, 2e-9},
                                   {-1e7, 1e8},    {99.5, 100.5},  {-0.3, -0.1},  {0, 0.00034},
                                   {1e6, 1e6 + 1}, {-17.3, 942.1}, {5e15, 6.3e15}};
  for (const PlotRange& range : kRanges) {
    for (const int most : {2, 4, 6, 10}) {
      const std::vector<double> ticks = Ticks(range, most);
      ASSERT_FALSE(ticks.empty()) << range.low << " " << most;
      EXPECT_LE(ticks.size(), static_cast<size_t>(most) + 1) << range.low << " to " << range.high;
      EXPECT_GE(ticks.front(), range.low - 1e-9 * range.Extent());
      EXPECT_LE(ticks.back(), range.high + 1e-9 * range.Extent());
      if (ticks.size() < 2) continue;
      const std::vector<std::string> labels = TickLabels(ticks);
      EXPECT_EQ(std::set<std::string>(labels.begin(), labels.end()).size(), ticks.size());
      const double step = ticks[1] - ticks[0];
      const double mantissa = step / std::pow(10.0, std::floor(std::log10(step * 1.0001)));
      EXPECT_TRUE(std::abs(mantissa - 1) < 1e-5 || std::abs(mantissa - 2) < 1e-5 ||
                  std::abs(mantissa - 5) < 1e-5)
          << mantissa;
      for (size_t i = 1; i < ticks.size(); ++i)
        EXPECT_NEAR(ticks[i] - ticks[i - 1], step, 1e-6 * step);
      EXPECT_GT(static_cast<double>(ticks.size() + 1) * step, range.Extent());
    }
  }
}

TEST(Ticks, EndWhereValuesDifferByRoundingAlone) {
  for (const double value : {1.5, -100.3, 430.7, 1e17}) {
    std::vector<double> values{value, value};
    for (int ulps = 0; ulps < 5; ++ulps) {
      const PlotRange range = RangeOf(values, 0.05);
      EXPECT_LT(range.low, range.high);
      const std::vector<double> ticks = Ticks(range, 6);
      EXPECT_LE(ticks.size(), 7u);
      EXPECT_GE(ticks.size(), 1u);
      values.push_back(std::nextafter(values.back(), 2 * std::abs(value)));
    }
  }
}

TEST(TickLabels, SayTheTicksWithJustTheDecimalsTheyNeed) {
  EXPECT_THAT(TickLabels({-1, 0, 1}), ElementsAre("-1", "0", "1"));
  EXPECT_THAT(TickLabels({-0.5, -0.0, 0.5}), ElementsAre("-0.5", "0.0", "0.5"));
  EXPECT_THAT(TickLabels({0.02, 0.04}), ElementsAre("0.02", "0.04"));
  EXPECT_THAT(TickLabels({100, 150, 200}), ElementsAre("100", "150", "200"));
  EXPECT_THAT(TickLabels({0.1, 0.2, 0.3}), ElementsAre("0.1", "0.2", "0.3"));
  EXPECT_TRUE(TickLabels({}).empty());
}

// A panel that is narrow in values has one tick, and its label must say where that is.
TEST(TickLabels, SayWhereATickAloneIs) {
  EXPECT_THAT(TickLabels(Ticks({0.1, 0.92}, 4)), ElementsAre("0.5"));
  EXPECT_THAT(TickLabels({0.25}), ElementsAre("0.25"));
  EXPECT_THAT(TickLabels({-12.5}), ElementsAre("-12.5"));
  EXPECT_THAT(TickLabels({3 * 0.1}), ElementsAre("0.3"));
  EXPECT_THAT(TickLabels({0}), ElementsAre("0"));
  EXPECT_THAT(TickLabels({400}), ElementsAre("400"));
}

TEST(PlotAxes, PutsTheRangesCornersAtTheBoxs) {
  const PlotAxes axes({{10, 20}, {200, 100}}, {-1, 3}, {5, 6});
  EXPECT_TRUE(axes.Pixel(-1, 5).isApprox(Eigen::Vector2d(10, 120)));
  EXPECT_TRUE(axes.Pixel(3, 6).isApprox(Eigen::Vector2d(210, 20)));
  EXPECT_TRUE(axes.Pixel(1, 5.5).isApprox(Eigen::Vector2d(110, 70)));
}

TEST(PlotAxes, OfEqualScaleShowASquareAsOneAndAllOfBothRanges) {
  for (const auto& [x, y] : {std::pair(PlotRange{0, 10}, PlotRange{0, 1}),
                             std::pair(PlotRange{-2, 2}, PlotRange{7, 90})}) {
    const PlotBox box{{30, 40}, {300, 150}};
    const PlotAxes axes = PlotAxes::EqualScale(box, x, y);
    const Eigen::Vector2d origin = axes.Pixel(x.low, y.low),
                          unit = axes.Pixel(x.low + 1, y.low + 1);
    EXPECT_NEAR(unit.x() - origin.x(), origin.y() - unit.y(), 1e-9);
    for (const Eigen::Vector2d& corner : {origin, axes.Pixel(x.high, y.high)}) {
      EXPECT_TRUE(((corner - box.corner).array() > -1e-9).all());
      EXPECT_TRUE(((box.corner + box.size - corner).array() > -1e-9).all());
    }
    const Eigen::Vector2d middle = axes.Pixel(0.5 * (x.low + x.high), 0.5 * (y.low + y.high));
    EXPECT_TRUE(middle.isApprox(box.corner + 0.5 * box.size));
  }
}

TEST(PlotAxes, DrawLabelsOnlyWhereAsked) {
  const PlotAxes axes({{50, 10}, {280, 130}}, {0, 4}, {0, 1});
  SvgWriter with(400, 200), without(400, 200);
  axes.Draw(with, "time, s", "error & more, m");
  axes.Draw(without, "", "y");
  EXPECT_THAT(with.Document(), HasSubstr("time, s"));
  EXPECT_THAT(with.Document(), HasSubstr("error &amp; more, m"));
  EXPECT_THAT(with.Document(), HasSubstr(">4</text>"));
  EXPECT_THAT(without.Document(), Not(HasSubstr(">4</text>")));
}

}  // namespace
}  // namespace deepuav
