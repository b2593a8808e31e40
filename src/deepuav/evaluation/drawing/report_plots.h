#pragma once

#include <string>
#include <utility>
#include <vector>

#include "deepuav/evaluation/report/run_report.h"

namespace deepuav {

/// The report's plots as SVG pictures for papers, by file name: for each run with truth
/// NAME-trajectory.svg (plan, x, y, z and error over time) and NAME-error.svg (the path coloured by
/// its error), and for all runs together errors.svg (absolute and relative error over time),
/// growth.svg and timings.svg, as far as there is something to show. Names have "-" for slashes,
/// and a number where they would be another run's. The same reports give the same text.
std::vector<std::pair<std::string, std::string>> ReportPlots(const std::vector<RunReport>& reports);

}  // namespace deepuav
