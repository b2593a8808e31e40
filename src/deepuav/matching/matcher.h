#pragma once

#include <string>
#include <vector>

#include "deepuav/features/features.h"

namespace deepuav {

/// Key point `a` of one image is key point `b` of the other.
struct Match {
  int a = 0, b = 0;
  float score = 0;  ///< In 0..1, higher is surer; comparable within one matcher only.
};

/// Finds which key points of two images show the same thing, without knowing their poses. Each key
/// point is in at most one match. One user at a time.
class Matcher {
 public:
  virtual ~Matcher() = default;

  /// Matches by rising `a`.
  virtual std::vector<Match> MatchFeatures(const Features& a, const Features& b) = 0;

  /// Names method and weights for summaries.
  virtual std::string Description() const = 0;
};

}  // namespace deepuav
