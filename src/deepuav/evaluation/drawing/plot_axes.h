#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "deepuav/evaluation/drawing/svg.h"

namespace deepuav {

/// An interval of data values.
struct PlotRange {
  double low = 0, high = 1;

  double Extent() const { return high - low; }
};

/// The range of the values with a margin on both sides; of width 1 about a single value.
PlotRange RangeOf(const std::vector<double>& values, double margin_ratio);

/// Round values (1, 2 or 5 times a power of ten apart) inside the range, which part it in at most
/// `most` steps, and usually in more than half as many.
std::vector<double> Ticks(const PlotRange& range, int most);

/// The ticks' labels, with just as many decimals as their distance needs.
std::vector<std::string> TickLabels(const std::vector<double>& ticks);

struct PlotBox {
  Eigen::Vector2d corner;  ///< Top left, pixels.
  Eigen::Vector2d size;
};

/// A rectangle of the picture that shows a range of x and y, y up.
class PlotAxes {
 public:
  PlotAxes(const PlotBox& box, const PlotRange& x, const PlotRange& y) : box_(box), x_(x), y_(y) {}

  /// The ranges grown about their middles so that both axes have the same scale.
  static PlotAxes EqualScale(const PlotBox& box, const PlotRange& x, const PlotRange& y);

  Eigen::Vector2d Pixel(double x, double y) const;

  /// Grid, ticks, frame and labels. Without x labels if `x_label` is empty: for panels stacked over
  /// a common axis.
  void Draw(SvgWriter& svg, const std::string& x_label, const std::string& y_label) const;

  /// A line through (x[i], y[i]), seen inside the box only.
  void Plot(SvgWriter& svg, const std::vector<Eigen::Vector2d>& points, const std::string& colour,
            double width) const;

  const PlotBox& box() const { return box_; }

 private:
  PlotBox box_;
  PlotRange x_, y_;
};

}  // namespace deepuav
