#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "deepuav/base/time.h"
#include "deepuav/image/image.h"

namespace deepuav {

/// An image as it comes, at its own size.
struct LiveImage {
  GreyImage image;
  std::optional<Timestamp> stream_time;  ///< On the source's own clock, if it has one.
};

/// Images that come when they are taken, whether or not anyone is ready for them. One thread.
class LiveSource {
 public:
  virtual ~LiveSource() = default;
  /// Opens it, or opens it again. Throws Error naming the source where that cannot be.
  virtual void Open() = 0;
  /// Waits for the next image; nothing where there is none any more: at the end, where the link
  /// dropped, or once `stop`, asked while it waits, says true.
  virtual std::optional<LiveImage> Next(const std::function<bool()>& stop) = 0;
  /// Whether nothing is there after the end: true of a file, false of a link.
  virtual bool EndsForGood() const = 0;
  /// Images that were left out unread, as they were late; all in all.
  virtual int64_t late() const { return 0; }
  /// For messages: without the user and password of an address.
  virtual std::string Name() const = 0;
};

}  // namespace deepuav
