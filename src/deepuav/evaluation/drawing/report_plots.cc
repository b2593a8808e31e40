#include "deepuav/evaluation/drawing/report_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <set>

#include "deepuav/base/median.h"
#include "deepuav/evaluation/drawing/plot_axes.h"
#include "deepuav/evaluation/drawing/trajectory_plot.h"

namespace deepuav {
namespace {

constexpr double kWidth = 760, kLeft = 75, kRight = 25, kTop = 40, kBottom = 50;
constexpr double kPanelHeight = 150, kPanelStep = 175;
constexpr double kSquare = 560, kTitleFont = 14, kLegendFont = 12, kLegendDash = 24, kLegendGap = 6,
                 kLegendRise = 4, kLetterWidth = 6.5, kLegendSpace = 22;
constexpr double kMargin = 0.06, kCurveWidth = 1.4, kPathWidth = 2.4, kTruthWidth = 1.6;
constexpr double kBarHeight = 14, kBarStep = 18, kStageGap = 8, kStageNames = 190;
constexpr const char* kTruthColour = "#999999";
// From the palette of Okabe and Ito, told apart by the colour-blind.
constexpr std::array<const char*, 7> kRunColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                    "#e69f00", "#56b4e9", "#000000"};
constexpr std::array<std::array<double, 3>, 5> kErrorColours = {
    {{45, 192, 160}, {155, 215, 112}, {247, 216, 74}, {232, 84, 47}, {179, 21, 74}}};
constexpr double kLargestShownQuantile = 0.98;

const char* RunColour(size_t run) { return kRunColours[run % kRunColours.size()]; }

std::string ErrorColour(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(kErrorColours.size() - 1);
  const size_t low = std::min(static_cast<size_t>(place), kErrorColours.size() - 2);
  const double rest = place - static_cast<double>(low);
  std::array<int, 3> rgb{};
  for (size_t i = 0; i < rgb.size(); ++i) {
    rgb[i] =
        static_cast<int>((1 - rest) * kErrorColours[low][i] + rest * kErrorColours[low + 1][i]);
  }
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

struct Curve {
  std::string colour;
  std::vector<Eigen::Vector2d> points;
};

struct Panel {
  std::string y_label;
  std::vector<Curve> curves;

  bool empty() const {
    return std::all_of(curves.begin(), curves.end(),
                       [](const Curve& curve) { return curve.points.empty(); });
  }
};

SvgWriter BlankPicture(double width, double height) {
  SvgWriter svg(width, height);
  svg.Rectangle({0, 0}, {width, height}, "#ffffff", "none");
  return svg;
}

void DrawLegend(SvgWriter& svg, const std::vector<RunReport>& reports) {
  Eigen::Vector2d at(kLeft, kTop - 2 * kLegendGap);
  for (size_t run = 0; run < reports.size(); ++run) {
    const Eigen::Vector2d from = at - Eigen::Vector2d(0, kLegendRise);
    svg.Line(from, from + Eigen::Vector2d(kLegendDash, 0), RunColour(run), kPathWidth);
    svg.Text(at + Eigen::Vector2d(kLegendDash + kLegendGap, 0), reports[run].run.name,
             TextAnchor::kStart, kLegendFont);
    at.x() += kLegendDash + kLegendSpace +
              kLetterWidth * static_cast<double>(reports[run].run.name.size());
  }
}

/// Panels one above the other over the same seconds; nothing where all are empty.
std::string PanelsOverTime(std::vector<Panel> panels, const std::vector<RunReport>& reports) {
  std::erase_if(panels, [](const Panel& panel) { return panel.empty(); });
  if (panels.empty()) return "";
  std::vector<double> seconds = {0};
  for (const Panel& panel : panels) {
    for (const Curve& curve : panel.curves) {
      for (const Eigen::Vector2d& point : curve.points) seconds.push_back(point.x());
    }
  }
  const double height =
      kTop + kBottom + kPanelHeight + static_cast<double>(panels.size() - 1) * kPanelStep;
  SvgWriter svg = BlankPicture(kWidth, height);
  DrawLegend(svg, reports);
  for (size_t i = 0; i < panels.size(); ++i) {
    std::vector<double> values = {0};
    for (const Curve& curve : panels[i].curves) {
      for (const Eigen::Vector2d& point : curve.points) values.push_back(point.y());
    }
    PlotRange range = RangeOf(values, kMargin);
    range.low = 0;
    const PlotBox box{{kLeft, kTop + static_cast<double>(i) * kPanelStep},
                      {kWidth - kLeft - kRight, kPanelHeight}};
    const PlotAxes axes(box, RangeOf(seconds, 0), range);
    axes.Draw(svg, i + 1 == panels.size() ? "time, s" : "", panels[i].y_label);
    for (const Curve& curve : panels[i].curves) {
      axes.Plot(svg, curve.points, curve.colour, kCurveWidth);
    }
  }
  return svg.Document();
}

/// One curve a run that has an evaluation.
Panel PanelOf(const std::vector<RunReport>& reports, const std::string& y_label,
              const std::function<void(const Evaluation&, Timestamp start, Curve*)>& fill) {
  Panel panel{y_label, {}};
  for (size_t run = 0; run < reports.size(); ++run) {
    Curve curve{RunColour(run), {}};
    if (reports[run].evaluation) fill(*reports[run].evaluation, reports[run].Start(), &curve);
    panel.curves.push_back(std::move(curve));
  }
  return panel;
}

std::string ErrorsOverTime(const std::vector<RunReport>& reports) {
  const auto absolute = [](const Evaluation& evaluation, Timestamp start, Curve* curve) {
    for (size_t i = 0; i < evaluation.matched_truth.size(); ++i) {
      curve->points.emplace_back(SecondsBetween(start, evaluation.matched_truth[i].time),
                                 evaluation.ate.errors_m[i]);
    }
  };
  const auto relative = [](std::vector<double> RelativeError::*errors) {
    return [errors](const Evaluation& evaluation, Timestamp start, Curve* curve) {
      if (!evaluation.rpe) return;
      const std::vector<double>& values = (*evaluation.rpe).*errors;
      for (size_t i = 0; i < values.size(); ++i) {
        const TimedPose& end = evaluation.matched_truth[evaluation.rpe->pairs[i].second];
        curve->points.emplace_back(SecondsBetween(start, end.time), values[i]);
      }
    };
  };
  return PanelsOverTime({PanelOf(reports, "ATE, m", absolute),
                         PanelOf(reports, "RPE, m", relative(&RelativeError::errors_m)),
                         PanelOf(reports, "RPE, deg", relative(&RelativeError::errors_deg))},
                        reports);
}

std::string Growth(const std::vector<RunReport>& reports) {
  Panel keyframes{"keyframes", {}}, landmarks{"landmarks", {}};
  for (size_t run = 0; run < reports.size(); ++run) {
    Curve keyframe_curve{RunColour(run), {}}, landmark_curve{RunColour(run), {}};
    const MapGrowth& growth = reports[run].growth;
    const auto& evaluation = reports[run].evaluation;
    const double offset_s = evaluation ? evaluation->time_offset_s : 0;
    for (size_t i = 0; i < growth.times.size(); ++i) {
      const double seconds = SecondsBetween(reports[run].Start(), growth.times[i]) + offset_s;
      keyframe_curve.points.emplace_back(seconds, static_cast<double>(i + 1));
      landmark_curve.points.emplace_back(seconds, growth.landmarks[i]);
    }
    keyframes.curves.push_back(std::move(keyframe_curve));
    landmarks.curves.push_back(std::move(landmark_curve));
  }
  return PanelsOverTime({keyframes, landmarks}, reports);
}

/// Bars of each stage's median, one a run.
std::string Timings(const std::vector<RunReport>& reports) {
  std::set<std::string> names;
  double longest_ms = 0;
  std::vector<std::map<std::string, double>> medians(reports.size());
  for (size_t run = 0; run < reports.size(); ++run) {
    for (const auto& [stage, ms] : reports[run].run.stage_ms) {
      names.insert(stage);
      medians[run][stage] = ms.empty() ? 0 : Median(ms);
      longest_ms = std::max(longest_ms, medians[run][stage]);
    }
  }
  if (longest_ms <= 0) return "";
  const double stage_step = kBarStep * static_cast<double>(reports.size()) + kStageGap;
  const double size = stage_step * static_cast<double>(names.size());
  SvgWriter svg = BlankPicture(kWidth, kTop + size + kBottom);
  DrawLegend(svg, reports);
  const PlotAxes axes({{kStageNames, kTop}, {kWidth - kStageNames - kRight, size}},
                      {0, (1 + kMargin) * longest_ms}, {0, 1});
  double top = kTop + kStageGap / 2;
  for (const double tick : Ticks({0, (1 + kMargin) * longest_ms}, 6)) {
    const double x = axes.Pixel(tick, 0).x();
    svg.Line({x, kTop}, {x, kTop + size}, "#e4e4e4", 1);
    svg.Text({x, kTop + size + 16}, fmt::format("{:g}", tick), TextAnchor::kMiddle, 11);
  }
  for (const std::string& name : names) {
    svg.Text({kStageNames - kLegendGap, top + 0.5 * stage_step}, name, TextAnchor::kEnd,
             kLegendFont);
    for (size_t run = 0; run < reports.size(); ++run) {
      const double x = axes.Pixel(medians[run][name], 0).x();
      svg.Rectangle({kStageNames, top + static_cast<double>(run) * kBarStep},
                    {x - kStageNames, kBarHeight}, RunColour(run), "none");
    }
    top += stage_step;
  }
  svg.Text({0.5 * (kStageNames + kWidth), kTop + size + 36}, "median of a call, ms",
           TextAnchor::kMiddle, kLegendFont);
  return svg.Document();
}

std::vector<double> Component(const Trajectory& first, const Trajectory& second, int axis) {
  std::vector<double> values;
  for (const Trajectory* trajectory : {&first, &second}) {
    for (const TimedPose& pose : *trajectory) {
      values.push_back(pose.world_from_cam.translation()[axis]);
    }
  }
  return values;
}

/// The path in plan, coloured by its error up to the `kLargestShownQuantile` of the errors.
std::string ErrorAlongPath(const Evaluation& evaluation) {
  const std::array<int, 2> plan = PlanAxes(evaluation.truth, evaluation.z_is_up);
  const Trajectory& path = evaluation.matched_estimate;
  const PlotAxes axes =
      PlotAxes::EqualScale({{kLeft, kTop}, {kSquare, kSquare}},
                           RangeOf(Component(evaluation.truth, path, plan[0]), kMargin),
                           RangeOf(Component(evaluation.truth, path, plan[1]), kMargin));
  std::vector<double> sorted = evaluation.ate.errors_m;
  std::sort(sorted.begin(), sorted.end());
  const double largest_m = std::max(
      sorted[static_cast<size_t>(kLargestShownQuantile * static_cast<double>(sorted.size() - 1))],
      1e-12);

  SvgWriter svg = BlankPicture(kLeft + kSquare + kRight, kTop + kSquare + kBottom);
  svg.Text({kLeft, kTop - 2 * kLegendGap},
           fmt::format("error from 0 ({}) to {:.3g} m ({}); truth grey", "green", largest_m, "red"),
           TextAnchor::kStart, kTitleFont);
  axes.Draw(svg, fmt::format("{}, m", "xyz"[plan[0]]), fmt::format("{}, m", "xyz"[plan[1]]));
  const auto place = [&](const TimedPose& pose) {
    const Eigen::Vector3d& position = pose.world_from_cam.translation();
    return Eigen::Vector2d(position[plan[0]], position[plan[1]]);
  };
  std::vector<Eigen::Vector2d> truth;
  for (const TimedPose& pose : evaluation.truth) truth.push_back(place(pose));
  axes.Plot(svg, truth, kTruthColour, kTruthWidth);
  for (size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector2d from = place(path[i - 1]), to = place(path[i]);
    svg.Line(axes.Pixel(from.x(), from.y()), axes.Pixel(to.x(), to.y()),
             ErrorColour(evaluation.ate.errors_m[i] / largest_m), kPathWidth);
  }
  return svg.Document();
}

/// What the files of each run are called: its name without slashes, numbered where that is another
/// run's already.
std::vector<std::string> FileNames(const std::vector<RunReport>& reports) {
  std::vector<std::string> names;
  for (const RunReport& report : reports) {
    std::string name = report.run.name;
    std::replace(name.begin(), name.end(), '/', '-');
    const std::string first = name;
    for (int number = 2; std::ranges::find(names, name) != names.end(); ++number)
      name = fmt::format("{}-{}", first, number);
    names.push_back(name);
  }
  return names;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> ReportPlots(
    const std::vector<RunReport>& reports) {
  std::vector<std::pair<std::string, std::string>> plots;
  const std::vector<std::string> names = FileNames(reports);
  for (size_t run = 0; run < reports.size(); ++run) {
    if (!reports[run].evaluation) continue;
    const Evaluation& evaluation = *reports[run].evaluation;
    plots.emplace_back(names[run] + "-trajectory.svg",
                       PlotTrajectories(evaluation, reports[run].options));
    plots.emplace_back(names[run] + "-error.svg", ErrorAlongPath(evaluation));
  }
  for (auto& [name, svg] :
       {std::pair("errors.svg", ErrorsOverTime(reports)), std::pair("growth.svg", Growth(reports)),
        std::pair("timings.svg", Timings(reports))}) {
    if (!svg.empty()) plots.emplace_back(name, svg);
  }
  return plots;
}

}  // namespace deepuav
