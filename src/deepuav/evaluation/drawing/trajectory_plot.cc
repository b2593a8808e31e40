#include "deepuav/evaluation/drawing/trajectory_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "deepuav/base/median.h"
#include "deepuav/evaluation/drawing/plot_axes.h"
#include "deepuav/evaluation/report/evaluation_report.h"

namespace deepuav {
namespace {

constexpr double kWidth = 1160, kHeight = 660;
const PlotBox kPlanBox{{75, 55}, {470, 390}};
const PlotBox kErrorBox{{75, 510}, {470, 100}};
const Eigen::Vector2d kFirstComponent(640, 55), kComponentSize(490, 175), kComponentStep(0, 190);
const Eigen::Vector2d kTitle(75, 30), kLegend(930, 30);
constexpr double kTitleFont = 14, kLegendFont = 12, kLegendDash = 26, kLegendGap = 6,
                 kLegendStep = 95, kLegendRise = 4;
constexpr double kMargin = 0.06;
constexpr double kTruthWidth = 2.2, kEstimateWidth = 1.4, kErrorWidth = 1.3;
constexpr double kStartRadius = 4;
constexpr double kGapInIntervals =
    4;  // Longer without a pose than this many usual intervals: the line breaks.
constexpr const char* kAxisNames[] = {"x", "y", "z"};
// From the palette of Okabe and Ito, told apart by the colour-blind.
constexpr const char *kTruthColour = "#999999", *kEstimateColour = "#0072b2",
                     *kErrorColour = "#d55e00";

/// A trajectory to draw: seconds since the first truth, positions, and where a line must break.
struct Track {
  std::vector<double> seconds;
  std::vector<Eigen::Vector3d> positions;
  std::vector<bool> starts_piece;
};

std::vector<bool> PieceStarts(const std::vector<double>& seconds) {
  std::vector<double> intervals;
  for (size_t i = 1; i < seconds.size(); ++i) intervals.push_back(seconds[i] - seconds[i - 1]);
  std::vector<bool> starts(seconds.size(), false);
  if (intervals.empty()) return starts;
  const double usual = Median(intervals);
  for (size_t i = 0; i < intervals.size(); ++i) {
    starts[i + 1] = usual > 0 && intervals[i] > kGapInIntervals * usual;
  }
  return starts;
}

Track MakeTrack(const Trajectory& poses, const Trajectory& clock, Timestamp origin) {
  Track track;
  for (size_t i = 0; i < poses.size(); ++i) {
    track.seconds.push_back(SecondsBetween(origin, clock[i].time));
    track.positions.push_back(poses[i].world_from_cam.translation());
  }
  track.starts_piece = PieceStarts(track.seconds);
  return track;
}

/// Plots the points `point(i)` of a track, broken where poses are missing.
template <typename PointOf>
void PlotPieces(SvgWriter& svg, const PlotAxes& axes, const Track& track, PointOf&& point,
                const char* colour, double width) {
  std::vector<Eigen::Vector2d> piece;
  for (size_t i = 0; i < track.seconds.size(); ++i) {
    if (track.starts_piece[i]) {
      axes.Plot(svg, piece, colour, width);
      piece.clear();
    }
    piece.push_back(point(i));
  }
  axes.Plot(svg, piece, colour, width);
}

std::vector<double> Component(const Track& truth, const Track& estimate, int axis) {
  std::vector<double> values;
  for (const Eigen::Vector3d& position : truth.positions) values.push_back(position[axis]);
  for (const Eigen::Vector3d& position : estimate.positions) values.push_back(position[axis]);
  return values;
}

std::string AxisLabel(int axis) { return fmt::format("{}, m", kAxisNames[axis]); }

void DrawPlan(SvgWriter& svg, const Track& truth, const Track& estimate,
              const std::array<int, 2>& plan) {
  const PlotAxes axes =
      PlotAxes::EqualScale(kPlanBox, RangeOf(Component(truth, estimate, plan[0]), kMargin),
                           RangeOf(Component(truth, estimate, plan[1]), kMargin));
  axes.Draw(svg, AxisLabel(plan[0]), AxisLabel(plan[1]));
  const auto draw = [&](const Track& track, const char* colour, double width) {
    const auto point = [&](size_t i) {
      return Eigen::Vector2d(track.positions[i][plan[0]], track.positions[i][plan[1]]);
    };
    PlotPieces(svg, axes, track, point, colour, width);
  };
  draw(truth, kTruthColour, kTruthWidth);
  draw(estimate, kEstimateColour, kEstimateWidth);
  const Eigen::Vector3d& start = estimate.positions.front();
  svg.Circle(axes.Pixel(start[plan[0]], start[plan[1]]), kStartRadius, kEstimateColour);
}

void DrawComponents(SvgWriter& svg, const Track& truth, const Track& estimate,
                    const PlotRange& time) {
  for (int axis = 0; axis < 3; ++axis) {
    const PlotBox box{kFirstComponent + axis * kComponentStep, kComponentSize};
    const PlotAxes axes(box, time, RangeOf(Component(truth, estimate, axis), kMargin));
    axes.Draw(svg, axis == 2 ? "time, s" : "", AxisLabel(axis));
    const auto draw = [&](const Track& track, const char* colour, double width) {
      const auto point = [&](size_t i) {
        return Eigen::Vector2d(track.seconds[i], track.positions[i][axis]);
      };
      PlotPieces(svg, axes, track, point, colour, width);
    };
    draw(truth, kTruthColour, kTruthWidth);
    draw(estimate, kEstimateColour, kEstimateWidth);
  }
}

void DrawErrors(SvgWriter& svg, const Track& estimate, const std::vector<double>& errors_m,
                const PlotRange& time) {
  PlotRange range = RangeOf(errors_m, kMargin);
  range.low = 0;
  const PlotAxes axes(kErrorBox, time, range);
  axes.Draw(svg, "time, s", "error, m");
  const auto point = [&](size_t i) { return Eigen::Vector2d(estimate.seconds[i], errors_m[i]); };
  PlotPieces(svg, axes, estimate, point, kErrorColour, kErrorWidth);
}

void DrawTitleAndLegend(SvgWriter& svg, const Evaluation& evaluation,
                        const EvaluationOptions& options) {
  svg.Text(kTitle,
           fmt::format("{} rmse {:.4g} m, alignment {}, {} poses, completeness {:.1f} %",
                       evaluation.horizontal ? "Horizontal ATE" : "ATE",
                       evaluation.ate.statistics_m.rmse, AlignmentName(options.alignment),
                       evaluation.matched_truth.size(), 100 * evaluation.Completeness()),
           TextAnchor::kStart, kTitleFont);
  Eigen::Vector2d at = kLegend;
  for (const auto& [name, colour, width] :
       {std::tuple("truth", kTruthColour, kTruthWidth),
        std::tuple("estimate", kEstimateColour, kEstimateWidth)}) {
    const Eigen::Vector2d from = at - Eigen::Vector2d(0, kLegendRise);
    svg.Line(from, from + Eigen::Vector2d(kLegendDash, 0), colour, width);
    svg.Text(at + Eigen::Vector2d(kLegendDash + kLegendGap, 0), name, TextAnchor::kStart,
             kLegendFont);
    at.x() += kLegendStep;
  }
}

}  // namespace

std::array<int, 2> PlanAxes(const Trajectory& truth, bool z_is_up) {
  if (z_is_up) return {0, 1};
  Eigen::Vector3d low = truth.front().world_from_cam.translation(), high = low;
  for (const TimedPose& pose : truth) {
    low = low.cwiseMin(pose.world_from_cam.translation());
    high = high.cwiseMax(pose.world_from_cam.translation());
  }
  int smallest = 2;
  for (const int axis : {1, 0}) {
    if (high[axis] - low[axis] < high[smallest] - low[smallest]) smallest = axis;
  }
  return {smallest == 0 ? 1 : 0, smallest == 2 ? 1 : 2};
}

std::string PlotTrajectories(const Evaluation& evaluation, const EvaluationOptions& options) {
  const Timestamp origin = evaluation.truth.front().time;
  const Track truth = MakeTrack(evaluation.truth, evaluation.truth, origin);
  // The truth's clock, so that a time offset does not move the estimate in the picture.
  const Track estimate = MakeTrack(evaluation.matched_estimate, evaluation.matched_truth, origin);
  const PlotRange time = RangeOf(truth.seconds, 0);

  SvgWriter svg(kWidth, kHeight);
  svg.Rectangle({0, 0}, {kWidth, kHeight}, "#ffffff", "none");
  DrawTitleAndLegend(svg, evaluation, options);
  DrawPlan(svg, truth, estimate, PlanAxes(evaluation.truth, evaluation.z_is_up));
  DrawErrors(svg, estimate, evaluation.ate.errors_m, time);
  DrawComponents(svg, truth, estimate, time);
  return svg.Document();
}

}  // namespace deepuav
