#include "deepuav/survey/growth/torn_ties.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <utility>

namespace deepuav {
namespace {

class TieGraph {
 public:
  TieGraph(const std::vector<Tie>& ties, int views)
      : of_view_(static_cast<size_t>(views)), total_(static_cast<size_t>(views), 0) {
    for (const Tie& tie : ties) {
      Add(tie.a, tie.b, tie.weight);
      Add(tie.b, tie.a, tie.weight);
    }
    most_ = std::ranges::count_if(of_view_, [](const auto& tied) { return !tied.empty(); }) / 2;
  }

  /// The block around the seed that is held least, and what holds it.
  std::pair<std::vector<int>, double> LeastHeld(int seed) const {
    std::vector<int> block;
    std::set<int> among;
    std::map<int, double> tied;  // To the block, of those beside it.
    double held = 0, least = 0;
    size_t best_size = 0;
    for (int next = seed; next >= 0 && std::ssize(block) < most_; next = LightestBeside(tied)) {
      held += total_[static_cast<size_t>(next)] - 2 * tied[next];
      tied.erase(next);
      among.insert(next);
      block.push_back(next);
      for (const auto& [other, weight] : of_view_[static_cast<size_t>(next)]) {
        if (!among.contains(other)) tied[other] += weight;
      }
      if (held < least) {
        least = held;
        best_size = block.size();
      }
    }
    block.resize(best_size);
    return {std::move(block), least};
  }

 private:
  void Add(int from, int to, double weight) {
    of_view_[static_cast<size_t>(from)].emplace_back(to, weight);
    total_[static_cast<size_t>(from)] += weight;
  }

  /// With which the block is held least; -1: nothing is tied to it.
  int LightestBeside(const std::map<int, double>& tied) const {
    int lightest = -1;
    double least = 0;
    for (const auto& [view, weight] : tied) {
      const double more = total_[static_cast<size_t>(view)] - 2 * weight;
      if (weight <= 0 || (lightest >= 0 && more >= least)) continue;
      lightest = view;
      least = more;
    }
    return lightest;
  }

  std::vector<std::vector<std::pair<int, double>>> of_view_;
  std::vector<double> total_;
  std::ptrdiff_t most_ = 0;
};

}  // namespace

std::vector<int> TornOff(const std::vector<Tie>& ties, int views) {
  const TieGraph graph(ties, views);
  std::set<int> seeds;
  for (const Tie& tie : ties) {
    if (tie.weight < 0) seeds.insert({tie.a, tie.b});
  }
  std::vector<int> torn;
  double least = 0;
  for (const int seed : seeds) {
    auto [block, held] = graph.LeastHeld(seed);
    if (held >= least) continue;
    torn = std::move(block);
    least = held;
  }
  std::ranges::sort(torn);
  return torn;
}

}  // namespace deepuav
