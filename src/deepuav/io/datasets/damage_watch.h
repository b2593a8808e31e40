#pragma once

#include <cstdint>
#include <optional>

#include "deepuav/base/option_bounds.h"

namespace deepuav {

/// How long a video's pictures may be damaged.
struct DamageOptions {
  double longest_s = 5;     ///< Where no picture is marked as standing alone...
  int most_pictures = 150;  ///< ...and where pictures have no times.
  int pictures_ahead = 4;   ///< Decoded before one is judged, as those shown before it may build
                            ///< on it.

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("longest_s", longest_s, "s",
          "after damage, in a video that marks no picture as standing alone, until pictures are "
          "taken to be whole",
          Between(0, 1e6));
    visit("most_pictures", most_pictures, "", "the same where pictures have no times",
          Between(0, 1'000'000));
    visit("pictures_ahead", pictures_ahead, "",
          "pictures decoded before one is judged, where pictures may build on later ones",
          Between(0, 64));
  }
};

/// Which pictures of a video show what was never seen: those decoded from data that contradict
/// themselves, and what builds on them, up to the next picture that stands alone. Some streams mark
/// none; there damage is over after a while.
class DamageWatch {
 public:
  explicit DamageWatch(const DamageOptions& options) : options_(options) {}

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
  void Begin(std::optional<int64_t> since_ns) {
    is_damaged_ = true;
    since_ns_ = since_ns;
    pictures_ = 0;
  }
  bool IsLongAgo() const {
    if (since_ns_ && latest_ns_)
      return 1e-9 * static_cast<double>(*latest_ns_ - *since_ns_) > options_.longest_s;
    return pictures_ > options_.most_pictures;
  }

  DamageOptions options_;
  bool is_damaged_ = false;
  std::optional<int64_t> since_ns_, latest_ns_;
  int pictures_ = 0;  ///< Since the damage.
};

}  // namespace deepuav
