#pragma once

#include <vector>

#include "deepuav/survey/pairs/view_pairs.h"

namespace deepuav {

/// One point of the ground in several photographs.
struct Track {
  struct Sight {
    int view = 0, keypoint = 0;
  };
  std::vector<Sight> sights;  ///< By rising view, at most one a view.
};

/// The tracks, and which of them each key point of each view belongs to (-1: none).
struct Tracks {
  std::vector<Track> tracks;
  std::vector<std::vector<int>> of_keypoint;
};

/// Joins matches to tracks, those of pairs with most matches first. A match that would put two key
/// points of one photograph into a track is left out.
Tracks JoinMatches(const std::vector<SurveyView>& views, const std::vector<MatchedPair>& pairs);

}  // namespace deepuav
