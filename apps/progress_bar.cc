#include "progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

namespace deepuav {
namespace {
constexpr double kRedrawSeconds = 0.2;
constexpr int kBarWidth = 30;
}  // namespace

ProgressBar::ProgressBar(int total) : total_(std::max(total, 1)), terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  if (terminal_) std::cerr << "\r\033[K" << std::flush;
}

void ProgressBar::Advance(int done, const std::string& status) {
  if (!terminal_ || (since_drawn_.Seconds() < kRedrawSeconds && done < total_)) return;
  since_drawn_.Restart();
  const int filled = std::min(kBarWidth, kBarWidth * done / total_);
  std::cerr << fmt::format("\r\033[K[{}{}] {}/{}  {:.1f} frames/s  {}", std::string(static_cast<size_t>(filled), '#'),
                           std::string(static_cast<size_t>(kBarWidth - filled), '.'), done, total_,
                           done / std::max(running_.Seconds(), 1e-3), status)
            << std::flush;
}

}  // namespace deepuav
