#pragma once

#include <string>

#include "deepuav/base/time.h"

namespace deepuav {

/// Least seconds between two messages.
struct ProgressPauses {
  double redraw_s = 0.2;  ///< Of the bar on a terminal.
  double log_s = 15;      ///< Between lines of the log.
};

/// One line on stderr that tells how far a run is; where stderr is no terminal, a line of the log
/// now and then.
class ProgressBar {
 public:
  /// `what` is counted, in the plural.
  explicit ProgressBar(int total, std::string what = "frames", const ProgressPauses& pauses = {});
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `status`: a few words on the present state.
  void Advance(int done, const std::string& status);

  /// Begins anew where something else is counted than before, or from 0 again.
  void Count(const std::string& what, int done, int total);

 private:
  int total_;
  std::string what_;
  const bool terminal_;
  const double pause_s_;
  Stopwatch running_, since_told_;
};

}  // namespace deepuav
