#include "deepuav/ortho/seams.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr int kNone = -1;
struct Step {
  int x, y;
};
constexpr Step kNeighbours[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

class SeamChooser {
 public:
  SeamChooser(const GroundGrid& grid, const ViewChoice& choice, const NodeColours& colours,
              const ColourLevels& levels, const SeamOptions& options)
      : grid_(grid), choice_(choice), options_(options), views_(grid.rows, grid.columns, kNone) {
    levelled_.resize(colours.size());
    for (size_t node = 0; node < colours.size(); ++node) {
      for (size_t slot = 0; slot < kMaxCandidates; ++slot) {
        const Candidate& candidate = choice.of_node[node][slot];
        if (candidate.view < 0) break;
        const cv::Vec3d factor =
            levels.Factor(candidate.view, static_cast<double>(candidate.radius2));
        levelled_[node][slot] = cv::Vec3b(cv::Vec3d(colours[node][slot]).mul(factor));
      }
    }
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column)
        views_(row, column) = choice.of_node[grid.Index(column, row)][0].view;
    }
  }

  /// Whether anything changed.
  bool Sweep() {
    bool changed = false;
    for (int row = 0; row < grid_.rows; ++row) {
      for (int column = 0; column < grid_.columns; ++column) {
        if (views_(row, column) == kNone || !IsOnSeam(column, row)) continue;
        const int view = BestAt(column, row);
        changed |= view != views_(row, column);
        views_(row, column) = view;
      }
    }
    return changed;
  }

  const cv::Mat1i& views() const { return views_; }

 private:
  bool IsOnSeam(int column, int row) const {
    return std::any_of(std::begin(kNeighbours), std::end(kNeighbours), [&](const Step& to) {
      return grid_.Holds(column + to.x, row + to.y) &&
             views_(row + to.y, column + to.x) != views_(row, column);
    });
  }

  int BestAt(int column, int row) const {
    const size_t node = grid_.Index(column, row);
    double least = std::numeric_limits<double>::infinity();
    int best = views_(row, column);
    for (const Candidate& candidate : choice_.of_node[node]) {
      if (candidate.view < 0) break;
      double cost = static_cast<double>(candidate.cost);
      for (const Step& to : kNeighbours) {
        if (!grid_.Holds(column + to.x, row + to.y)) continue;
        const int other = views_(row + to.y, column + to.x);
        if (other == kNone || other == candidate.view) continue;
        const size_t neighbour = grid_.Index(column + to.x, row + to.y);
        cost += options_.length_cost + options_.mismatch_cost *
                                           (Mismatch(node, candidate.view, other) +
                                            Mismatch(neighbour, candidate.view, other)) /
                                           2;
      }
      if (cost < least) least = cost, best = candidate.view;
    }
    return best;
  }

  /// From 0 to 1, between what two views show at a node; 1 where one does not show it.
  double Mismatch(size_t node, int a, int b) const {
    constexpr double kWhite = 255;
    const cv::Vec3b *of_a = nullptr, *of_b = nullptr;
    for (size_t slot = 0; slot < kMaxCandidates; ++slot) {
      const int view = choice_.of_node[node][slot].view;
      if (view == a) of_a = &levelled_[node][slot];
      if (view == b) of_b = &levelled_[node][slot];
    }
    if (!of_a || !of_b) return 1;
    return std::min(1.0, cv::norm(cv::Vec3i(*of_a) - cv::Vec3i(*of_b)) / (kWhite * std::sqrt(3.0)));
  }

  const GroundGrid& grid_;
  const ViewChoice& choice_;
  const SeamOptions& options_;
  NodeColours levelled_;
  cv::Mat1i views_;
};

}  // namespace

void SeamOptions::Check() const { CheckOptions("", *this); }

cv::Mat1i ChooseSeams(const GroundGrid& grid, const ViewChoice& choice, const NodeColours& colours,
                      const ColourLevels& levels, const SeamOptions& options) {
  options.Check();
  SeamChooser chooser(grid, choice, colours, levels, options);
  for (int sweep = 0; sweep < options.sweeps && chooser.Sweep(); ++sweep) {
  }
  return chooser.views();
}

}  // namespace deepuav
