#include "deepuav/evaluation/drawing/plot_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr double kPixelsPerTickX = 70, kPixelsPerTickY = 32;
constexpr double kTickLength = 4, kTickFont = 11, kLabelFont = 12;
constexpr double kXTickLabelGap = 16, kXLabelGap = 34, kYTickLabelGap = 7, kYLabelGap = 50;
constexpr double kBaselineShift = 4;
constexpr double kLeastExtent = 1e-9;  ///< Of an axis, as a share of its largest value.
constexpr const char *kGridColour = "#e4e4e4", *kFrameColour = "#444";

int TickCount(double pixels, double pixels_per_tick) {
  return std::max(2, static_cast<int>(pixels / pixels_per_tick));
}

int DecimalsOfStep(double step) {
  return std::max(0, -static_cast<int>(std::floor(std::log10(step * (1 + 1e-9)))));
}

/// Without a step to tell: as many as the values themselves need.
int DecimalsOfAll(const std::vector<double>& values) {
  constexpr int kMost = 12;
  constexpr double kRounding = 1e-9;
  int decimals = 0;
  for (const double value : values) {
    double scaled = std::abs(value) * std::pow(10.0, decimals);
    for (; decimals < kMost && std::abs(scaled - std::round(scaled)) > kRounding * scaled;
         scaled *= 10)
      ++decimals;
  }
  return decimals;
}

}  // namespace

PlotRange RangeOf(const std::vector<double>& values, double margin_ratio) {
  if (values.empty()) return {};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  // What differs by less is rounding: an axis of it would have ticks that doubles cannot tell
  // apart.
  const double least = kLeastExtent * std::max({std::abs(*low), std::abs(*high), 1.0});
  const double extent = *high - *low;
  const double margin = extent > least ? margin_ratio * extent : std::max(0.5, least);
  return {*low - margin, *high + margin};
}

std::vector<double> Ticks(const PlotRange& range, int most) {
  const double finest = range.Extent() / most;
  const double power = std::pow(10.0, std::floor(std::log10(finest)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= finest) step = factor * power;
  }
  std::vector<double> ticks;
  const double last = std::floor(range.high / step);
  const double first = std::ceil(range.low / step);
  for (int i = 0; i <= most && first + i <= last; ++i) ticks.push_back((first + i) * step);
  return ticks;
}

std::vector<std::string> TickLabels(const std::vector<double>& ticks) {
  const int decimals =
      ticks.size() > 1 ? DecimalsOfStep(ticks[1] - ticks[0]) : DecimalsOfAll(ticks);
  std::vector<std::string> labels;
  for (const double tick : ticks) {
    // Adding zero turns -0 into 0.
    labels.push_back(fmt::format("{:.{}f}", tick + 0.0, decimals));
  }
  return labels;
}

PlotAxes PlotAxes::EqualScale(const PlotBox& box, const PlotRange& x, const PlotRange& y) {
  const double units_per_pixel = std::max(x.Extent() / box.size.x(), y.Extent() / box.size.y());
  const auto grown = [units_per_pixel](const PlotRange& range, double pixels) {
    const double middle = 0.5 * (range.low + range.high);
    const double half = 0.5 * units_per_pixel * pixels;
    return PlotRange{middle - half, middle + half};
  };
  return PlotAxes(box, grown(x, box.size.x()), grown(y, box.size.y()));
}

Eigen::Vector2d PlotAxes::Pixel(double x, double y) const {
  return box_.corner + Eigen::Vector2d((x - x_.low) / x_.Extent() * box_.size.x(),
                                       (y_.high - y) / y_.Extent() * box_.size.y());
}

void PlotAxes::Draw(SvgWriter& svg, const std::string& x_label, const std::string& y_label) const {
  const double left = box_.corner.x(), right = left + box_.size.x();
  const double top = box_.corner.y(), bottom = top + box_.size.y();

  const std::vector<double> x_ticks = Ticks(x_, TickCount(box_.size.x(), kPixelsPerTickX));
  const std::vector<std::string> x_names = TickLabels(x_ticks);
  for (size_t i = 0; i < x_ticks.size(); ++i) {
    const double x = Pixel(x_ticks[i], y_.low).x();
    svg.Line({x, top}, {x, bottom}, kGridColour, 1);
    svg.Line({x, bottom}, {x, bottom + kTickLength}, kFrameColour, 1);
    if (!x_label.empty()) {
      svg.Text({x, bottom + kXTickLabelGap}, x_names[i], TextAnchor::kMiddle, kTickFont);
    }
  }

  const std::vector<double> y_ticks = Ticks(y_, TickCount(box_.size.y(), kPixelsPerTickY));
  const std::vector<std::string> y_names = TickLabels(y_ticks);
  for (size_t i = 0; i < y_ticks.size(); ++i) {
    const double y = Pixel(x_.low, y_ticks[i]).y();
    svg.Line({left, y}, {right, y}, kGridColour, 1);
    svg.Line({left - kTickLength, y}, {left, y}, kFrameColour, 1);
    svg.Text({left - kYTickLabelGap, y + kBaselineShift}, y_names[i], TextAnchor::kEnd, kTickFont);
  }

  svg.Rectangle(box_.corner, box_.size, "none", kFrameColour);
  if (!x_label.empty()) {
    svg.Text({0.5 * (left + right), bottom + kXLabelGap}, x_label, TextAnchor::kMiddle, kLabelFont);
  }
  svg.Text({left - kYLabelGap, 0.5 * (top + bottom)}, y_label, TextAnchor::kMiddle, kLabelFont,
           -90);
}

void PlotAxes::Plot(SvgWriter& svg, const std::vector<Eigen::Vector2d>& points,
                    const std::string& colour, double width) const {
  std::vector<Eigen::Vector2d> pixels;
  pixels.reserve(points.size());
  for (const Eigen::Vector2d& point : points) pixels.push_back(Pixel(point.x(), point.y()));
  svg.BeginClip(box_.corner, box_.size);
  svg.Polyline(pixels, colour, width);
  svg.EndClip();
}

}  // namespace deepuav
