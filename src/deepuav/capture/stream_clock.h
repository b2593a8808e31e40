#pragma once

#include <optional>
#include <string>

#include "deepuav/base/time.h"

namespace deepuav {

/// The time of arrival: the system's clock when it was made, from then on one that never jumps.
class ArrivalClock {
 public:
  ArrivalClock();
  Timestamp Now() const;

 private:
  const Timestamp start_;
  const Stopwatch since_start_;
};

/// Which clock the images' times are of.
enum class ImageClock { kArrival, kStream };

struct StreamClockOptions {
  ImageClock clock = ImageClock::kArrival;
  double max_jump_s = 10;  ///< By which the stream's clock may go off the time of arrival at once.
};

/// Gives images times that grow: of their arrival, or of the stream, whose clock may jump.
class StreamClock {
 public:
  explicit StreamClock(const StreamClockOptions& options) : options_(options) {}

  /// The time of the next image, later than that of the image before. Where the stream's clock
  /// jumped, times go on by the arrival's, and `jump` says so.
  Timestamp TimeOf(std::optional<Timestamp> stream, Timestamp arrival, std::string* jump);
  /// The stream was opened again: its clock may begin anew.
  void Reopened() { is_reopened_ = last_.has_value(); }

 private:
  struct Image {
    Timestamp time, arrival;
  };

  const StreamClockOptions options_;
  std::optional<Image> last_;
  int64_t offset_ns_ = 0;  ///< From the stream's clock to the images' times.
  bool is_reopened_ = false;
};

}  // namespace deepuav
