#pragma once

#include <cstdint>
#include <optional>

namespace deepuav {

/// Which pictures of a video show what was never seen: those decoded from data that contradict
/// themselves, and what builds on them, up to the next picture that stands alone. Some streams mark
/// none; there damage is over after 5 s, or 150 pictures without times.
class DamageWatch {
 public:
  /// A packet could not be decoded at all.
  void Lost() { Begin(latest_ns_); }

  /// The next picture, as shown; whether it is damaged.
  bool Judge(bool contradicts, bool stands_alone, std::optional<int64_t> shown_ns) {
    latest_ns_ = shown_ns;
    if (contradicts) {
      Begin(shown_ns);
    } else if (stands_alone || IsLongAgo()) {
      is_damaged_ = false;
    }
    ++pictures_;
    return is_damaged_;
  }

 private:
  static constexpr int64_t kLongestNs = 5'000'000'000;
  static constexpr int kMostPictures = 150;

  void Begin(std::optional<int64_t> since_ns) {
    is_damaged_ = true;
    since_ns_ = since_ns;
    pictures_ = 0;
  }
  bool IsLongAgo() const {
    if (since_ns_ && latest_ns_) return *latest_ns_ - *since_ns_ > kLongestNs;
    return pictures_ > kMostPictures;
  }

  bool is_damaged_ = false;
  std::optional<int64_t> since_ns_, latest_ns_;
  int pictures_ = 0;  ///< Since the damage.
};

}  // namespace deepuav
