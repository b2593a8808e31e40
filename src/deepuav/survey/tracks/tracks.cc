#include "deepuav/survey/tracks/tracks.h"

#include <algorithm>
#include <numeric>

namespace deepuav {
namespace {

/// Union of key points, each set with the views that it has key points of.
class KeypointSets {
 public:
  explicit KeypointSets(const std::vector<SurveyView>& views) {
    for (const SurveyView& view : views) {
      begin_.push_back(static_cast<int>(sights_.size()));
      for (int i = 0; i < view.frame.features->size(); ++i)
        sights_.push_back({{{static_cast<int>(begin_.size()) - 1, i}}});
    }
    parent_.resize(sights_.size());
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  void Join(int view_a, int keypoint_a, int view_b, int keypoint_b) {
    int a = Root(Index(view_a, keypoint_a)), b = Root(Index(view_b, keypoint_b));
    if (a == b || ShareAView(a, b)) return;
    std::vector<Track::Sight>& into = At(a).sights;
    std::vector<Track::Sight>& from = At(b).sights;
    std::vector<Track::Sight> joined(into.size() + from.size());
    std::merge(into.begin(), into.end(), from.begin(), from.end(), joined.begin(), ByView);
    into = std::move(joined);
    from = {};
    parent_[static_cast<size_t>(b)] = a;
  }

  std::vector<Track> Sets() const {
    std::vector<Track> sets;
    for (const Track& track : sights_) {
      if (track.sights.size() > 1) sets.push_back(track);
    }
    return sets;
  }

 private:
  static bool ByView(const Track::Sight& a, const Track::Sight& b) { return a.view < b.view; }

  int Index(int view, int keypoint) const { return begin_[static_cast<size_t>(view)] + keypoint; }
  Track& At(int set) { return sights_[static_cast<size_t>(set)]; }

  int Root(int set) {
    while (parent_[static_cast<size_t>(set)] != set) {
      int& parent = parent_[static_cast<size_t>(set)];
      parent = parent_[static_cast<size_t>(parent)];
      set = parent;
    }
    return set;
  }

  bool ShareAView(int a, int b) {
    auto of_a = At(a).sights.begin(), of_b = At(b).sights.begin();
    while (of_a != At(a).sights.end() && of_b != At(b).sights.end()) {
      if (of_a->view == of_b->view) return true;
      of_a->view < of_b->view ? ++of_a : ++of_b;
    }
    return false;
  }

  std::vector<int> begin_;  ///< By view.
  std::vector<Track> sights_;
  std::vector<int> parent_;
};

}  // namespace

Tracks JoinMatches(const std::vector<SurveyView>& views, const std::vector<MatchedPair>& pairs) {
  std::vector<const MatchedPair*> by_matches;
  for (const MatchedPair& pair : pairs) by_matches.push_back(&pair);
  std::stable_sort(by_matches.begin(), by_matches.end(),
                   [](const MatchedPair* a, const MatchedPair* b) {
                     return a->matches.size() > b->matches.size();
                   });
  KeypointSets sets(views);
  for (const MatchedPair* pair : by_matches) {
    for (const Match& match : pair->matches) sets.Join(pair->a, match.a, pair->b, match.b);
  }
  Tracks joined;
  joined.tracks = sets.Sets();
  for (const SurveyView& view : views) {
    joined.of_keypoint.emplace_back(static_cast<size_t>(view.frame.features->size()), -1);
  }
  for (size_t i = 0; i < joined.tracks.size(); ++i) {
    for (const Track::Sight& sight : joined.tracks[i].sights) {
      joined.of_keypoint[static_cast<size_t>(sight.view)][static_cast<size_t>(sight.keypoint)] =
          static_cast<int>(i);
    }
  }
  return joined;
}

}  // namespace deepuav
