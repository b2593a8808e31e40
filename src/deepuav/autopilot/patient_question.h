#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace deepuav {

/// When something is to be asked for again: after pauses that grow, as an autopilot whose link does
/// not bear what is asked for is to be left in peace, though not for ever: the question may have
/// been lost. Thread-compatible; times: nanoseconds.
class PatientQuestion {
 public:
  PatientQuestion(double first_pause_s, double longest_pause_s)
      : first_pause_s_(first_pause_s), longest_pause_s_(longest_pause_s), pause_s_(first_pause_s) {}

  /// Whether to ask now, which is done then; never what was asked for and comes.
  bool IsDue(int64_t now_ns, bool comes) {
    if (asked_ns_ && comes) {
      pause_s_ = first_pause_s_;
      return false;
    }
    if (asked_ns_ && now_ns - *asked_ns_ < std::llround(1e9 * pause_s_)) return false;
    if (asked_ns_) pause_s_ = std::min(2 * pause_s_, longest_pause_s_);
    asked_ns_ = now_ns;
    if (!first_asked_ns_) first_asked_ns_ = now_ns;
    return true;
  }
  /// Who is asked knows nothing of the questions before.
  void Restart() {
    asked_ns_.reset();
    pause_s_ = first_pause_s_;
  }
  const std::optional<int64_t>& first_asked_ns() const { return first_asked_ns_; }

 private:
  const double first_pause_s_, longest_pause_s_;
  double pause_s_;  ///< Until it is asked again.
  std::optional<int64_t> asked_ns_, first_asked_ns_;
};

}  // namespace deepuav
