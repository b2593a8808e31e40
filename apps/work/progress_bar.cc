#include "work/progress_bar.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

constexpr int kBarWidth = 30;
constexpr size_t kUsualColumns = 80;
constexpr char kClearLine[] = "\r\033[K";

size_t TerminalColumns() {
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kUsualColumns;
}

}  // namespace

ProgressBar::ProgressBar(int total, std::string what, const ProgressPauses& pauses)
    : total_(std::max(total, 1)),
      what_(std::move(what)),
      terminal_(isatty(STDERR_FILENO) != 0),
      pause_s_(terminal_ ? pauses.redraw_s : pauses.log_s) {
  // A line of the log takes the place of the bar, which is drawn again below it.
  if (terminal_) Log().set_pattern(fmt::format("{}%^%l%$: %v", kClearLine));
}

ProgressBar::~ProgressBar() {
  if (terminal_) std::cerr << kClearLine << std::flush;
}

void ProgressBar::Count(const std::string& what, int done, int total) {
  if (what != what_ || done == 0) {
    what_ = what;
    total_ = std::max(total, 1);
    running_.Restart();
  }
  Advance(done, "");
}

void ProgressBar::Advance(int done, const std::string& status) {
  if (since_told_.Seconds() < pause_s_ && !(terminal_ && done >= total_)) return;
  since_told_.Restart();
  const double per_second = done / std::max(running_.Seconds(), 1e-3);
  if (!terminal_) {
    Log().info("{} of {} {}, {:.1f} {}/s", done, total_, what_, per_second, what_);
    return;
  }
  const int filled = std::min(kBarWidth, kBarWidth * done / total_);
  std::string line = fmt::format("[{:#<{}}{:.<{}}] {}/{}  {:.1f} {}/s  {}", "", filled, "",
                                 kBarWidth - filled, done, total_, per_second, what_, status);
  line.resize(std::min(line.size(), TerminalColumns() - 1));  // a wrapped line cannot be redrawn
  std::cerr << kClearLine << line << std::flush;
}

}  // namespace deepuav
