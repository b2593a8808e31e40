#pragma once

#include <optional>
#include <string>

#include "deepuav/autopilot/autopilot_news.h"
#include "deepuav/autopilot/clock_sync.h"
#include "deepuav/autopilot/mavlink_messages.h"
#include "deepuav/autopilot/patient_question.h"
#include "deepuav/base/option_check.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

struct AutopilotGnssOptions {
  bool wanted = false;             ///< The autopilot is asked for its receiver's fixes.
  double rate_hz = 5;              ///< Asked for.
  double origin_every_s = 5;       ///< So often for the origin of its local frame.
  double clock_sigma_s = 0.2;      ///< How late the autopilot may have the receiver's fixes.
  double max_sigma_m = 25;         ///< Stated horizontally; a fix with more is left aside.
  double max_age_s = 1;            ///< Of a fix when it comes, else its time is of another clock...
  double max_ahead_s = 0.2;        ///< ...or this much ahead of now: then it is of when it came.
  double least_interval_s = 0.02;  ///< Of two fixes.
  double stopped_s = 3;            ///< Without a fix: then they stopped.
  double none_came_s = 20;         ///< After the first question: then none come.
  double first_pause_s = 1;        ///< Between two questions for them, each twice the last...
  double longest_pause_s = 30;     ///< ...to this.

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("wanted", wanted, "", "the autopilot is asked for its receiver's fixes");
    visit("rate_hz", rate_hz, "Hz", "asked for", Between(0.1, 50));
    visit("origin_every_s", origin_every_s, "s", "for the origin of its local frame",
          Between(0.1, 3600));
    visit("clock_sigma_s", clock_sigma_s, "s",
          "how late the autopilot may have the receiver's fixes", Between(0, 10));
    visit("max_sigma_m", max_sigma_m, "m",
          "stated of a fix, horizontally; one with more is left aside", Above(0, 1e6));
    visit("max_age_s", max_age_s, "s",
          "of a fix when it comes; with more its time is of another clock", Above(0, 60));
    visit("max_ahead_s", max_ahead_s, "s", "of a fix's time, ahead of now; the same",
          Between(0, 60));
    visit("least_interval_s", least_interval_s, "s", "of two fixes", Between(1e-3, 60));
    visit("stopped_s", stopped_s, "s", "without a fix, after which they stopped", Above(0, 3600));
    visit("none_came_s", none_came_s, "s",
          "after the first question for fixes, when it is told that none come", Above(0, 3600));
    visit("first_pause_s", first_pause_s, "s",
          "between two questions for fixes; each pause is twice the last", Above(0, 3600));
    visit("longest_pause_s", longest_pause_s, "s", "of these pauses", Above(0, 3600));
  }
  void CheckRelations() const {
    CheckOption(first_pause_s <= longest_pause_s, "first_pause_s", first_pause_s,
                "at most longest_pause_s");
  }
};

/// What an autopilot's GNSS receiver says: asked for until it comes, judged, and brought on the
/// machine's clock. Thread-compatible; times: nanoseconds of the machine's clock.
class AutopilotGnss {
 public:
  /// Messages that were no fixes, by why.
  struct LeftAside {
    int64_t no_place = 0;      ///< The receiver had none, or one that is nowhere.
    int64_t uncertain = 0;     ///< Beyond the bound.
    int64_t before_clock = 0;  ///< The autopilot's clock was not known.
    int64_t out_of_time = 0;   ///< Not later than the one before, or the same again.
  };
  /// Which messages it is to be asked for.
  struct Ask {
    bool fixes = false, origin = false;
  };

  explicit AutopilotGnss(const AutopilotGnssOptions& options)
      : options_(options),
        fixes_(options.first_pause_s, options.longest_pause_s),
        origin_(options.first_pause_s, options.longest_pause_s) {}

  /// The fix, its time on the machine's clock and later than that of the one before.
  std::optional<GnssFix> Take(const FixMessage& message, const ClockSync& clock, int64_t now_ns);
  /// The autopilot told its origin.
  void HeardOrigin(int64_t now_ns) { origin_ns_ = now_ns; }
  /// The autopilot began, or began anew: it was not asked.
  void Restart();
  Ask DueAsk(int64_t now_ns);
  /// What changed, once.
  std::optional<AutopilotNews> DueNews(int64_t now_ns);

  const LeftAside& left_aside() const { return left_aside_; }

 private:
  int64_t TimeOf(const FixMessage& message, const ClockSync& clock, int64_t now_ns) const;
  std::string WhyNone() const;

  const AutopilotGnssOptions options_;
  LeftAside left_aside_;
  PatientQuestion fixes_, origin_;
  std::optional<FixMessage> sent_;     ///< That came last.
  std::optional<int64_t> last_ns_;     ///< The latest fix's time...
  std::optional<int64_t> taken_ns_;    ///< ...and when it came.
  std::optional<int64_t> message_ns_;  ///< When a message came, of whatever it holds.
  std::optional<int64_t> origin_ns_;   ///< When the origin was told.
  bool says_they_come_ = false, said_there_are_none_ = false;
};

}  // namespace deepuav
