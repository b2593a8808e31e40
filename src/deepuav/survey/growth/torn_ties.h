#pragma once

#include <vector>

namespace deepuav {

/// How much two views say that they lie as a map has them to one another; negative: that they
/// don't.
struct Tie {
  int a = 0, b = 0;
  double weight = 0;
};

/// The views, at most half of those that are tied, that as a whole are held against the others less
/// than torn away from them, most of such: by rising number. Empty: none. Found by greedy growth
/// from each end of a negative tie.
std::vector<int> TornOff(const std::vector<Tie>& ties, int views);

}  // namespace deepuav
