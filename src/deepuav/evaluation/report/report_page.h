#pragma once

#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/evaluation/report/run_report.h"

namespace deepuav {

struct ReportPageOptions {
  int max_points = 60000;  ///< Of each run's cloud; evenly thinned out beyond.

  /// Throws Error for a value that cannot be.
  void Check() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_points", max_points, "", "points of each cloud in the page",
          Between(0, 100'000'000));
  }
};

/// One HTML page with scripts, styles and data inside, which needs no network. The same reports
/// give the same bytes.
std::string ReportPage(const std::vector<RunReport>& reports, const std::string& version,
                       const ReportPageOptions& options = {});

}  // namespace deepuav
