#include "deepuav/survey/overlap.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "deepuav/base/median.h"
#include "deepuav/survey/reduced_views.h"

namespace deepuav {
namespace {

constexpr size_t kProbes = 60;  // points of a view that stand for what it sees

/// By how many quarter turns clockwise the image of a looks like that of b.
int QuarterTurns(const SE3& b_from_a) {
  const Eigen::Vector3d right_of_a = b_from_a.rotation() * Eigen::Vector3d::UnitX();
  const double angle = std::atan2(right_of_a.y(), right_of_a.x());
  const auto turns = static_cast<int>(std::lround(angle / (std::numbers::pi / 2)));
  return (turns % 4 + 4) % 4;
}

/// What a view sees of what another one does.
struct Overlap {
  int view = 0;
  double share = 0;
  int halvings = 0;  ///< Of the other one; negative: of this one.
};

class OverlapSearch {
 public:
  OverlapSearch(const Tracks& tracks, const SurveyState& state, const cv::Size& image_size,
                bool across_heights)
      : tracks_(tracks), state_(state), size_(image_size), across_heights_(across_heights) {
    for (size_t v = 0; v < state.cam_from_world.size(); ++v) {
      if (state.cam_from_world[v]) views_.push_back(static_cast<int>(v));
    }
  }

  const std::vector<int>& views() const { return views_; }
  const SE3& PoseOf(int view) const { return *state_.cam_from_world[static_cast<size_t>(view)]; }

  /// Of all other views.
  std::vector<Overlap> With(int a) const {
    const std::vector<Eigen::Vector3d> probes = ProbesOf(a);
    std::vector<Overlap> overlaps;
    for (const int b : views_) {
      if (b != a) overlaps.push_back(Between(a, b, probes));
    }
    return overlaps;
  }

 private:
  std::vector<Eigen::Vector3d> ProbesOf(int view) const {
    std::vector<Eigen::Vector3d> seen, probes;
    for (const int track : tracks_.of_keypoint[static_cast<size_t>(view)]) {
      if (track >= 0 && state_.points[static_cast<size_t>(track)])
        seen.push_back(*state_.points[static_cast<size_t>(track)]);
    }
    const size_t step = std::max<size_t>(1, seen.size() / kProbes);
    for (size_t i = 0; i < seen.size(); i += step) probes.push_back(seen[i]);
    return probes;
  }

  Overlap Between(int a, int b, const std::vector<Eigen::Vector3d>& probes) const {
    int inside = 0;
    std::vector<double> ratios;  // of the distances along the axes
    for (const Eigen::Vector3d& probe : probes) {
      const Eigen::Vector3d point = PoseOf(b) * probe;
      if (point.z() <= 0) continue;
      const Eigen::Vector2d px = state_.lens.camera.Project(point);
      if (px.x() < 0 || px.y() < 0 || px.x() >= size_.width || px.y() >= size_.height) continue;
      ++inside;
      const double z_a = (PoseOf(a) * probe).z();
      if (z_a > 0) ratios.push_back(point.z() / z_a);
    }
    Overlap overlap{b};
    if (!probes.empty()) overlap.share = static_cast<double>(inside) / std::ssize(probes);
    if (across_heights_ && !ratios.empty())
      overlap.halvings = HalvingsFor(Median(std::move(ratios)));
    return overlap;
  }

  const Tracks& tracks_;
  const SurveyState& state_;
  const cv::Size size_;
  const bool across_heights_;
  std::vector<int> views_;
};

}  // namespace

std::vector<PairCandidate> OverlappingPairs(const Tracks& tracks, const SurveyState& state,
                                            const cv::Size& image_size, bool across_heights,
                                            const SurveyOptions& options) {
  const OverlapSearch search(tracks, state, image_size, across_heights);
  std::set<PairCandidate> pairs;
  for (const int a : search.views()) {
    std::vector<Overlap> level, other_heights;
    for (const Overlap& overlap : search.With(a)) {
      if (overlap.share < options.min_overlap) continue;
      (overlap.halvings == 0 ? level : other_heights).push_back(overlap);
    }
    const auto keep_most = [&options](std::vector<Overlap>* overlaps) {
      std::ranges::stable_sort(*overlaps, [](const Overlap& one, const Overlap& other) {
        const int halvings = std::abs(one.halvings), others = std::abs(other.halvings);
        return halvings != others ? halvings < others : one.share > other.share;
      });
      const auto most = static_cast<size_t>(options.overlap_neighbours);
      if (overlaps->size() > most) overlaps->resize(most);
    };
    keep_most(&level);
    keep_most(&other_heights);
    level.insert(level.end(), other_heights.begin(), other_heights.end());
    for (const auto& [b, share, halvings] : level) {
      const int first = std::min(a, b), second = std::max(a, b);
      const int turns = QuarterTurns(search.PoseOf(second) * search.PoseOf(first).Inverse());
      // Between two sizes either may show more.
      if (std::abs(halvings) <= 1) pairs.insert({first, second, turns, 0});
      if (halvings != 0) pairs.insert({first, second, turns, first == a ? halvings : -halvings});
    }
  }
  return {pairs.begin(), pairs.end()};
}

}  // namespace deepuav
