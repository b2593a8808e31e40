#pragma once

#include <optional>
#include <string>

#include "deepuav/autopilot/clock_sync.h"
#include "deepuav/autopilot/gentle_offset.h"
#include "deepuav/autopilot/mavlink_messages.h"
#include "deepuav/base/option_bounds.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

struct AutopilotImuOptions {
  bool wanted = false;               ///< The autopilot is asked for its inertial samples.
  double rate_hz = 200;              ///< Asked for.
  double max_specific_force = 200;   ///< m/s^2, an axis: no sensor of an autopilot shows more.
  double max_angular_velocity = 40;  ///< rad/s, the same.
  double max_age_s = 1;              ///< Of a sample when it comes.

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("wanted", wanted, "", "the autopilot is asked for its inertial samples");
    visit("rate_hz", rate_hz, "Hz", "asked for", Between(20, 1000));
    visit("max_specific_force", max_specific_force, "m/s^2",
          "of an axis; a sample with more is left aside", Above(0, 1e4));
    visit("max_angular_velocity", max_angular_velocity, "rad/s", "the same", Above(0, 1e3));
    visit("max_age_s", max_age_s, "s", "of a sample when it comes", Above(0, 60));
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
  struct News {
    std::string text;  ///< For STATUSTEXT.
    std::string why;   ///< More, for the log.
    bool is_warning = false;
  };

  explicit AutopilotImu(const AutopilotImuOptions& options) : options_(options) {}

  /// The sample, its time on the machine's clock and later than that of the one before.
  std::optional<ImuSample> Take(const InertialMessage& message, const ClockSync& clock,
                                int64_t now_ns);
  /// The autopilot began, or began anew: it was not asked.
  void Restart();
  /// Which messages it is to be asked for now, while it is there.
  Ask DueAsk(int64_t now_ns);
  /// What changed, once.
  std::optional<News> DueNews(int64_t now_ns);

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
  std::optional<int64_t> asked_ns_, first_asked_ns_;
  double pause_s_ = 1;  ///< Until it is asked again.
  int asks_ = 0;
  bool says_they_come_ = false, said_there_are_none_ = false;
};

}  // namespace deepuav
