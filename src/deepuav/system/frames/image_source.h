#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "deepuav/base/ids.h"
#include "deepuav/base/time.h"
#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/image/image.h"

namespace deepuav {

struct TimedImage {
  FrameId id;
  Timestamp time;
  GreyImage image;
  double decode_s = 0;  ///< What reading it took.
  /// How the camera turned while it was read, where the source knows it and the run's sensors do
  /// not.
  std::optional<ReadoutMotion> turn_in_readout = {};
  double turn_sigma_rad = 0;  ///< Of that: how well it is known.
  /// now_from_before since the image given before, likewise.
  std::optional<Eigen::Quaterniond> turn_since_before = {};
};

/// Where the images come from. One thread at a time.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  /// The next image that can be read, by growing id and time; nothing at the end.
  virtual std::optional<TimedImage> Next() = 0;
  /// When the `ahead`-th image after the next was taken; nothing beyond the end.
  virtual std::optional<Timestamp> UpcomingTime(int ahead) const = 0;
  /// Leaves the next image out without reading it.
  virtual void Skip() = 0;
  /// Whether images come when they are taken, and the source itself leaves out those that are late.
  virtual bool KeepsPace() const { return false; }
};

}  // namespace deepuav
