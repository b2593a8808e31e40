#pragma once

#include <optional>
#include <string>

#include "deepuav/autopilot/autopilot_news.h"
#include "deepuav/autopilot/clock_sync.h"
#include "deepuav/autopilot/gentle_offset.h"
#include "deepuav/autopilot/mavlink_messages.h"
#include "deepuav/autopilot/patient_question.h"
#include "deepuav/base/option_check.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

struct AutopilotImuOptions {
  bool wanted = false;               ///< The autopilot is asked for its inertial samples.
  double rate_hz = 200;              ///< Asked for.
  double max_specific_force = 200;   ///< m/s^2, an axis: no sensor of an autopilot shows more.
  double max_angular_velocity = 40;  ///< rad/s, the same.
  double max_age_s = 1;              ///< Of a sample when it comes.
  double max_ahead_s = 0.2;          ///< Of now: a clock that was found by a slow answer is off.
  double least_interval_s = 0.0005;  ///< Of two samples.
  double highres_gone_s = 2;         ///< Without it: then the coarse message takes its place.
  double rate_over_s = 1;            ///< Over which the rate is counted.
  double stopped_s = 2;              ///< Without a sample: then they stopped.
  double none_came_s = 10;           ///< After the first question: then none come.
  double first_pause_s = 1;          ///< Between two questions for them, each twice the last...
  double longest_pause_s = 30;       ///< ...to this.
  double enough_of_rate = 0.8;       ///< Share of what was asked for.
  int asks_for_highres_alone = 3;    ///< Before it is asked for the coarse message, too.

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("wanted", wanted, "", "the autopilot is asked for its inertial samples");
    visit("rate_hz", rate_hz, "Hz", "asked for", Between(20, 1000));
    visit("max_specific_force", max_specific_force, "m/s^2",
          "of an axis; a sample with more is left aside", Above(0, 1e4));
    visit("max_angular_velocity", max_angular_velocity, "rad/s", "the same", Above(0, 1e3));
    visit("max_age_s", max_age_s, "s", "of a sample when it comes", Above(0, 60));
    visit("max_ahead_s", max_ahead_s, "s", "of a sample's time, ahead of now", Between(0, 60));
    visit("least_interval_s", least_interval_s, "s", "of two samples", Between(1e-6, 1));
    visit("highres_gone_s", highres_gone_s, "s",
          "without HIGHRES_IMU, after which SCALED_IMU takes its place", Above(0, 3600));
    visit("rate_over_s", rate_over_s, "s", "over which the samples' rate is counted",
          Between(0.1, 3600));
    visit("stopped_s", stopped_s, "s", "without a sample, after which they stopped",
          Above(0, 3600));
    visit("none_came_s", none_came_s, "s",
          "after the first question for samples, when it is told that none come", Above(0, 3600));
    visit("first_pause_s", first_pause_s, "s",
          "between two questions for samples; each pause is twice the last", Above(0, 3600));
    visit("longest_pause_s", longest_pause_s, "s", "of these pauses", Above(0, 3600));
    visit("enough_of_rate", enough_of_rate, "",
          "share of the rate that was asked for, with which it is not asked again", Above(0, 1));
    visit("asks_for_highres_alone", asks_for_highres_alone, "",
          "questions for HIGHRES_IMU before it is asked for SCALED_IMU, too", Between(0, 1000));
  }
  void CheckRelations() const {
    CheckOption(first_pause_s <= longest_pause_s, "first_pause_s", first_pause_s,
                "at most longest_pause_s");
  }
};

/// What an autopilot's inertial sensor says: asked for until it comes, judged, and brought on the
/// machine's clock. Thread-compatible; times: nanoseconds of the machine's clock.
class AutopilotImu {
 public:
  /// Messages that were no samples, by why.
  struct LeftAside {
    int64_t implausible = 0;   ///< Not finite, beyond the bounds, or not measured anew.
    int64_t other_sensor = 0;  ///< A second one, or the coarse message beside the fine one.
    int64_t before_clock = 0;  ///< The autopilot's clock was not known.
    int64_t out_of_time = 0;   ///< Of no time about now, or not later than the one before.
  };
  struct Ask {
    bool highres = false, scaled = false;
  };

  explicit AutopilotImu(const AutopilotImuOptions& options)
      : options_(options), question_(options.first_pause_s, options.longest_pause_s) {}

  /// The sample, its time on the machine's clock and later than that of the one before.
  std::optional<ImuSample> Take(const InertialMessage& message, const ClockSync& clock,
                                int64_t now_ns);
  /// The autopilot began, or began anew: it was not asked.
  void Restart();
  /// Which messages it is to be asked for now, while it is there.
  Ask DueAsk(int64_t now_ns);
  /// What changed, once.
  std::optional<AutopilotNews> DueNews(int64_t now_ns);

  const LeftAside& left_aside() const { return left_aside_; }

 private:
  bool IsPlausible(const InertialMessage& message) const;
  bool IsOfTheSensor(const InertialMessage& message, int64_t now_ns);
  bool IsFine(int64_t now_ns) const;
  void MeasureRate(int64_t now_ns);
  std::string WhyNone() const;

  const AutopilotImuOptions options_;
  GentleOffset offset_;
  LeftAside left_aside_;
  std::optional<int> sensor_;                ///< That which was heard first.
  std::optional<int64_t> highres_ns_;        ///< When the fine message came last.
  std::optional<int64_t> last_ns_;           ///< The latest sample's time...
  std::optional<int64_t> taken_ns_;          ///< ...and when it came.
  std::optional<int64_t> counted_since_ns_;  ///< A message of the sensor came then...
  int counted_ = 0;                          ///< ...and so many after it.
  double rate_hz_ = 0;                       ///< Of these, when it was measured last.
  PatientQuestion question_;
  int asks_ = 0;
  bool says_they_come_ = false, said_there_are_none_ = false;
};

}  // namespace deepuav
