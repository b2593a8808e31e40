#include "deepuav/assembly/settings/camera_checks.h"

#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"

namespace deepuav {

void CheckSameCamera(const std::string& file, const Camera& of_maps, const Camera& other,
                     const std::string& whose, bool is_approximate) {
  if (of_maps.width != other.width || of_maps.height != other.height) {
    throw Error("{}: its camera has {} x {} px: expected {} x {} as {}", file, of_maps.width,
                of_maps.height, other.width, other.height, whose);
  }
  // Shares of half the diagonal: as much as a focal length may be off by.
  constexpr double kNoticed = 0.005, kOther = 0.05, kOtherThanRoughly = 0.5;
  const double half_diagonal_px = 0.5 * std::hypot(other.width, other.height);
  const double difference_px = LargestDifferencePx(other, of_maps);
  const double most_px = (is_approximate ? kOtherThanRoughly : kOther) * half_diagonal_px;
  if (difference_px > most_px) {
    throw Error(
        "{}: its camera (focal length {:.1f} px) sees points up to {:.0f} px from where {} "
        "({:.1f} px) does: expected at most {:.0f}",
        file, of_maps.pinhole.fx, difference_px, whose, other.pinhole.fx, most_px);
  }
  if (is_approximate || difference_px < kNoticed * half_diagonal_px) return;
  Log().warn("{}: its camera is taken, which sees points up to {:.1f} px from where {} does", file,
             difference_px, whose);
}

}  // namespace deepuav
