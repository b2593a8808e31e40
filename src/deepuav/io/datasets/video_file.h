#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "deepuav/io/datasets/damage_watch.h"

namespace deepuav {

/// The pictures of a video file, in the order in which they are shown. Thread-compatible.
class VideoFile {
 public:
  struct Picture {
    std::optional<int64_t> shown_ns;  ///< On the container's clock; nothing where it does not say.
    /// It was decoded from data that contradict themselves, or builds on a picture that was: some
    /// of what it shows was never seen.
    bool is_damaged = false;
  };

  struct Packets {
    int count = 0;
    /// Of each packet's picture, growing; empty where the container does not say of each, or gives
    /// two the same time.
    std::vector<int64_t> shown_ns;
  };

  /// Throws Error naming the file where it cannot be opened as a video or has no picture's size.
  VideoFile(const std::filesystem::path& file, const DamageOptions& damage);
  ~VideoFile();

  int width() const;
  int height() const;
  /// Pictures a second as the container says; 0 where it does not.
  double rate_hz() const;
  /// Degrees, clockwise, by which the container wants pictures turned before they are shown: 0, 90,
  /// 180 or 270. They are given as they are stored.
  int rotation_deg() const;

  /// What the container holds, without decoding anything. Begins anew.
  Packets ReadPackets();

  void Rewind();
  /// Decodes the next picture; nothing at the end. What cannot be decoded at all is passed over.
  std::optional<Picture> Next();
  /// The picture that Next gave last, as BGR, of its own size; empty where there is none that can
  /// be shown. It is the caller's.
  cv::Mat Pixels();

 private:
  class Reader;
  std::unique_ptr<Reader> reader_;
};

}  // namespace deepuav
