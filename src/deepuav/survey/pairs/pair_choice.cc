#include "deepuav/survey/pairs/pair_choice.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "deepuav/place/place_index.h"
#include "deepuav/survey/pairs/near_views.h"

namespace deepuav {
namespace {

/// A pair in which the lower number comes first. Turning the other one back is as good.
PairCandidate Ordered(int a, int b, int quarter_turns) {
  if (a < b) return {a, b, quarter_turns};
  return {b, a, (4 - quarter_turns) % 4};
}

/// What a view resembles under each heading.
struct Resemblance {
  float similarity = 0;
  int view = 0, quarter_turns = 0;
};

/// The views by their words, asked under the headings that a view was described under.
class LikeViews {
 public:
  LikeViews(const std::vector<SurveyView>& views, const Vocabulary& vocabulary)
      : views_(views), vocabulary_(vocabulary) {
    for (size_t v = 0; v < views.size(); ++v)
      index_.Add({static_cast<int64_t>(v)}, vocabulary.Words(views[v].FeaturesAt(0).descriptors));
  }

  /// Words of the view as it is and turned clockwise by quarters; empty where it was not described.
  std::array<BagOfWords, 4> WordsOf(int view) const {
    const SurveyView& seen = views_[static_cast<size_t>(view)];
    std::array<BagOfWords, 4> words;
    words[0] = UprightWordsOf(view);
    for (size_t i = 0; i < seen.turned.size(); ++i) {
      if (seen.turned[i].size() > 0) words[i + 1] = vocabulary_.Words(seen.turned[i].Load());
    }
    return words;
  }

  const BagOfWords& UprightWordsOf(int view) const { return index_.At({view}); }

  /// Others, each under the heading that makes it most alike.
  std::vector<Resemblance> Like(int view, const std::array<BagOfWords, 4>& words, int count) const {
    std::vector<Resemblance> all;
    for (size_t turns = 0; turns < words.size(); ++turns) {
      for (const PlaceIndex::Hit& hit : index_.Query(words[turns], count + 1)) {
        const auto other = static_cast<int>(hit.keyframe.value);
        if (other != view) all.push_back({hit.similarity, other, static_cast<int>(turns)});
      }
    }
    std::stable_sort(all.begin(), all.end(), [](const Resemblance& a, const Resemblance& b) {
      return a.similarity > b.similarity;
    });
    std::vector<Resemblance> best;
    std::set<int> taken;
    for (const Resemblance& one : all) {
      if (static_cast<int>(best.size()) == count) break;
      if (taken.insert(one.view).second) best.push_back(one);
    }
    return best;
  }

 private:
  const std::vector<SurveyView>& views_;
  const Vocabulary& vocabulary_;
  PlaceIndex index_;
};

std::vector<std::set<int>> NearOnes(const std::vector<SurveyView>& views,
                                    const SurveyOptions& options) {
  std::vector<std::optional<Eigen::Vector3d>> positions_m;
  for (const SurveyView& view : views) positions_m.push_back(view.position_m);
  return NearViews(positions_m, options.position_neighbours, options.sequence_neighbours);
}

/// Of pairs of near views the heading under which they are most alike.
class NearPairs {
 public:
  explicit NearPairs(std::vector<std::set<int>> near) : near_(std::move(near)) {}

  void Ask(int view, const std::array<BagOfWords, 4>& words, const LikeViews& like) {
    for (const int other : near_[static_cast<size_t>(view)]) {
      for (size_t turns = 0; turns < words.size(); ++turns) {
        const float similarity = Similarity(words[turns], like.UprightWordsOf(other));
        const PairCandidate pair = Ordered(view, other, static_cast<int>(turns));
        const auto [at, is_new] =
            best_.try_emplace({pair.a, pair.b}, std::pair(similarity, Ordered(view, other, 0)));
        if (similarity > at->second.first) at->second = {similarity, pair};
      }
    }
  }

  void AddTo(std::set<PairCandidate>* pairs) const {
    for (const auto& [views, best] : best_) pairs->insert(best.second);
  }

 private:
  const std::vector<std::set<int>> near_;
  std::map<std::pair<int, int>, std::pair<float, PairCandidate>> best_;
};

}  // namespace

std::vector<PairCandidate> ChoosePairs(const std::vector<SurveyView>& views,
                                       const Vocabulary* vocabulary, const SurveyOptions& options) {
  std::set<PairCandidate> pairs;
  const int count = static_cast<int>(views.size());
  for (int a = 0; a < count; ++a) {
    const int last = std::min(count - 1, a + options.sequence_neighbours);
    for (int b = a + 1; b <= last; ++b) pairs.insert({a, b, 0});
  }
  std::vector<std::set<int>> near = NearOnes(views, options);
  if (!vocabulary) {
    for (int a = 0; a < count; ++a) {
      for (const int b : near[static_cast<size_t>(a)]) pairs.insert(Ordered(a, b, 0));
    }
    return {pairs.begin(), pairs.end()};
  }
  const LikeViews like(views, *vocabulary);
  NearPairs near_pairs(std::move(near));
  for (int v = 0; v < count; ++v) {
    const std::array<BagOfWords, 4> words = like.WordsOf(v);
    for (const Resemblance& one : like.Like(v, words, options.similar_neighbours))
      pairs.insert(Ordered(v, one.view, one.quarter_turns));
    near_pairs.Ask(v, words, like);
  }
  near_pairs.AddTo(&pairs);
  return {pairs.begin(), pairs.end()};
}

}  // namespace deepuav
