#pragma once

#include <cstdint>
#include <deque>

namespace deepuav {

/// Finds the autopilot's clock by questions and answers (TIMESYNC). Thread-compatible.
class ClockSync {
 public:
  /// The mark of a question that is asked now.
  int64_t Ask(int64_t now_ns);
  /// An answer: the autopilot's clock when it answered, and the question's mark. What answers no
  /// open question, came late or cannot be a clock is left aside.
  void Answer(int64_t autopilot_ns, int64_t mark_ns, int64_t now_ns);

  bool is_known() const { return is_known_; }
  /// The autopilot's clock once it is known, else this machine's.
  int64_t TimeOf(int64_t local_ns) const { return local_ns + offset_ns_; }

 private:
  struct Sample {
    int64_t offset_ns = 0, delay_ns = 0;
  };
  void Approach(int64_t offset_ns, int64_t now_ns);

  std::deque<int64_t> open_;    ///< Marks of questions without answer.
  std::deque<Sample> samples_;  ///< Of the latest answers.
  int64_t offset_ns_ = 0, approached_ns_ = 0;
  int contradictions_ = 0;  ///< In a row.
  bool is_known_ = false;
};

}  // namespace deepuav
