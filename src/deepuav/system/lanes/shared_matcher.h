#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "deepuav/matching/matcher.h"

namespace deepuav {

/// Lets tracking, mapping and loop closing use one matcher from their threads, one call at a time.
class SharedMatcher : public Matcher {
 public:
  /// `matcher` must outlive it.
  explicit SharedMatcher(Matcher* matcher) : matcher_(matcher) {}

  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    const std::scoped_lock lock(mutex_);
    return matcher_->MatchFeatures(a, b);
  }
  std::string Description() const override { return matcher_->Description(); }

 private:
  Matcher* matcher_;
  std::mutex mutex_;
};

}  // namespace deepuav
