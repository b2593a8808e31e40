#include "deepuav/survey/pairs/overlap.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

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
};

class OverlapSearch {
 public:
  OverlapSearch(const Tracks& tracks, const SurveyState& state, const cv::Size& image_size)
      : tracks_(tracks), state_(state), size_(image_size) {
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
      if (b != a) overlaps.push_back(Between(b, probes));
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

  Overlap Between(int b, const std::vector<Eigen::Vector3d>& probes) const {
    int inside = 0;
    for (const Eigen::Vector3d& probe : probes) {
      const Eigen::Vector3d point = PoseOf(b) * probe;
      if (!state_.lens.Reaches(point)) continue;
      const Eigen::Vector2d px = state_.lens.camera.Project(point);
      inside += px.x() >= 0 && px.y() >= 0 && px.x() < size_.width && px.y() < size_.height;
    }
    return {b, probes.empty() ? 0 : static_cast<double>(inside) / std::ssize(probes)};
  }

  const Tracks& tracks_;
  const SurveyState& state_;
  const cv::Size size_;
  std::vector<int> views_;
};

}  // namespace

std::vector<PairCandidate> OverlappingPairs(const Tracks& tracks, const SurveyState& state,
                                            const cv::Size& image_size,
                                            const SurveyOptions& options) {
  const OverlapSearch search(tracks, state, image_size);
  std::set<PairCandidate> pairs;
  for (const int a : search.views()) {
    std::vector<Overlap> overlaps = search.With(a);
    std::erase_if(overlaps, [&](const Overlap& o) { return o.share < options.min_overlap; });
    std::ranges::stable_sort(overlaps, std::greater{}, &Overlap::share);
    const auto most = static_cast<size_t>(options.overlap_neighbours);
    if (overlaps.size() > most) overlaps.resize(most);
    for (const auto& [b, share] : overlaps) {
      const int first = std::min(a, b), second = std::max(a, b);
      const int turns = QuarterTurns(search.PoseOf(second) * search.PoseOf(first).Inverse());
      pairs.insert({first, second, turns, 0});
    }
  }
  return {pairs.begin(), pairs.end()};
}

}  // namespace deepuav
