#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "deepuav/matching/matcher.h"

namespace deepuav {

/// A matcher that is made when it is asked first: many runs never need it. One user at a time.
class LateMatcher : public Matcher {
 public:
  using Make = std::function<std::unique_ptr<Matcher>()>;

  explicit LateMatcher(Make make) : make_(std::move(make)) {}

  /// Throws what making it throws.
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    if (!matcher_) matcher_ = make_();
    return matcher_->MatchFeatures(a, b);
  }

  std::string Description() const override {
    return matcher_ ? matcher_->Description() : "not asked";
  }

 private:
  Make make_;
  std::unique_ptr<Matcher> matcher_;
};

}  // namespace deepuav
