#pragma once

#include <string>

#include "deepuav/base/time.h"

namespace deepuav {

/// One line on stderr that tells how far a run is; where stderr is no terminal, a line of the log
/// now and then.
class ProgressBar {
 public:
  /// `what` is counted, in the plural.
  explicit ProgressBar(int total, std::string what = "frames");
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
  Stopwatch running_, since_told_;
};

}  // namespace deepuav
