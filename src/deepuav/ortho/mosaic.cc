#include "deepuav/ortho/mosaic.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <opencv2/imgproc.hpp>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/ortho/node_patch.h"

namespace deepuav {
namespace {

constexpr float kFarOutside = -1e6f;  // of any photograph

/// Photographs that were used last stay decoded.
class PhotographCache {
 public:
  PhotographCache(Photographs* photographs, double most_mb)
      : photographs_(photographs), most_bytes_(most_mb * 1e6) {}

  cv::Mat3b Load(int view, const cv::Size& size) {
    const auto found = std::find_if(kept_.begin(), kept_.end(),
                                    [view](const Kept& kept) { return kept.view == view; });
    if (found != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, found);
      return found->image;
    }
    kept_.push_front({view, photographs_->Load(view, size)});
    double bytes = 0;
    for (auto kept = kept_.begin(); kept != kept_.end();) {
      bytes += static_cast<double>(kept->image.total() * kept->image.elemSize());
      const bool stays = kept == kept_.begin() || bytes <= most_bytes_;
      kept = stays ? std::next(kept) : kept_.erase(kept);
    }
    return kept_.front().image;
  }

 private:
  struct Kept {
    int view;
    cv::Mat3b image;
  };
  Photographs* photographs_;
  double most_bytes_;
  std::list<Kept> kept_;  ///< The last used first.
};

class MosaicMaker {
 public:
  MosaicMaker(const MosaicPlan& plan, int cells_a_step, Photographs* photographs,
              const MosaicOptions& options)
      : plan_(plan),
        grid_(plan.surface.grid),
        cells_a_step_(cells_a_step),
        options_(options),
        stored_size_(photographs->stored_size()),
        cache_(photographs, options.cache_mb) {
    constexpr double kReach = 2.5;  // standard deviations
    reach_ = static_cast<int>(std::ceil(kReach * options.feather_nodes));
    const double width = plan.scene.camera.width, height = plan.scene.camera.height;
    middle_ = {(width - 1) / 2, (height - 1) / 2};
    half_diagonal2_ = (width * width + height * height) / 4;
    FindSizes();
  }

  /// Empty where nothing is seen.
  cv::Mat4b Make(const cv::Rect& window) {
    const cv::Rect nodes = NodesOf(window);
    const std::set<int> views = ViewsIn(nodes);
    if (views.empty()) return {};
    cv::Mat4f sums = cv::Mat4f::zeros(window.size());
    for (const int view : views) {
      const NodePatch patch = PatchOf(view, nodes);
      if (patch.nodes.empty()) continue;
      AddPhotograph(patch, cache_.Load(view, sizes_[static_cast<size_t>(view)]), cells_a_step_,
                    window, &sums);
    }
    return Colours(sums);
  }

 private:
  /// Photographs are loaded at the size that has the raster's detail.
  void FindSizes() {
    const Camera& camera = plan_.scene.camera;
    std::vector<double> depths(plan_.scene.views.size(), 0);
    for (int row = 0; row < grid_.rows; ++row) {
      for (int column = 0; column < grid_.columns; ++column) {
        const int view = plan_.view_of_node(row, column);
        if (view < 0 || depths[static_cast<size_t>(view)] > 0) continue;
        const auto seen = LookAt(view, column, row);
        if (seen) depths[static_cast<size_t>(view)] = seen->depth;
      }
    }
    const double cell = grid_.step / cells_a_step_;
    const double most = 1.0 * stored_size_.width / camera.width;
    for (const double depth : depths) {
      const double scale =
          std::clamp(depth / camera.pinhole.fx / cell, std::min(1.0 / camera.width, most), most);
      sizes_.emplace_back(std::max(1, static_cast<int>(std::lround(scale * camera.width))),
                          std::max(1, static_cast<int>(std::lround(scale * camera.height))));
    }
  }

  std::optional<SeenAt> LookAt(int view, int column, int row) const {
    return Look(plan_.scene.camera, plan_.scene.views[static_cast<size_t>(view)],
                plan_.scene.frame.world_from_ground(plan_.surface.Node(column, row)));
  }

  /// Those between which the cells lie.
  cv::Rect NodesOf(const cv::Rect& window) const {
    const cv::Point first(window.x / cells_a_step_, window.y / cells_a_step_);
    const cv::Point last((window.br().x - 1) / cells_a_step_ + 1,
                         (window.br().y - 1) / cells_a_step_ + 1);
    return {first, last + cv::Point(1, 1)};
  }

  cv::Rect Widened(const cv::Rect& nodes) const {
    return cv::Rect(nodes.x - reach_, nodes.y - reach_, nodes.width + 2 * reach_,
                    nodes.height + 2 * reach_) &
           cv::Rect(0, 0, grid_.columns, grid_.rows);
  }

  std::set<int> ViewsIn(const cv::Rect& nodes) const {
    std::set<int> views;
    const cv::Mat1i part = plan_.view_of_node(Widened(nodes));
    for (const int view : part) {
      if (view >= 0) views.insert(view);
    }
    return views;
  }

  /// Where no view sees the node, those about it may count up to the edge of their images.
  bool MayCount(int view, int column, int row) const {
    const Candidates& candidates = plan_.choice.of_node[grid_.Index(column, row)];
    return candidates[0].view < 0 ||
           std::any_of(candidates.begin(), candidates.end(),
                       [view](const Candidate& candidate) { return candidate.view == view; });
  }

  /// Only the nodes about which the view counts.
  NodePatch PatchOf(int view, const cv::Rect& nodes) const {
    const cv::Rect wide = Widened(nodes);
    cv::Mat1f weights;
    cv::Mat(plan_.view_of_node(wide) == view).convertTo(weights, CV_32F, 1.0 / 255);
    if (options_.feather_nodes > 0) {
      cv::GaussianBlur(weights, weights, {2 * reach_ + 1, 2 * reach_ + 1}, options_.feather_nodes,
                       options_.feather_nodes, cv::BORDER_REPLICATE);
    }
    const cv::Mat1f inner = weights(nodes - wide.tl());
    cv::Rect used = cv::boundingRect(cv::Mat(inner > 0));
    if (used.empty()) return {};
    // Cells between a node that counts and one that does not are the patch's, too.
    used = cv::Rect(used.x - 1, used.y - 1, used.width + 2, used.height + 2) &
           cv::Rect({}, nodes.size());
    NodePatch patch;
    patch.nodes = used + nodes.tl();
    patch.values.resize(static_cast<size_t>(used.area()));
    cv::parallel_for_({patch.nodes.y, patch.nodes.br().y}, [&](const cv::Range& rows) {
      for (int row = rows.start; row < rows.end; ++row) {
        for (int column = patch.nodes.x; column < patch.nodes.br().x; ++column)
          patch.At(column, row) =
              ValuesAt(view, column, row, inner(row - nodes.y, column - nodes.x));
      }
    });
    return patch;
  }

  NodePatch::Values ValuesAt(int view, int column, int row, float weight) const {
    NodePatch::Values nothing = {0, kFarOutside, kFarOutside, 1, 1, 1};
    if (!plan_.surface.Has(column, row)) return nothing;
    const auto seen = LookAt(view, column, row);
    if (!seen) return nothing;
    const Camera& camera = plan_.scene.camera;
    const cv::Size& size = sizes_[static_cast<size_t>(view)];
    const cv::Vec3d factor = plan_.levels.Factor(
        view, std::min(1.0, (seen->px - middle_).squaredNorm() / half_diagonal2_));
    return {MayCount(view, column, row) ? weight : 0,
            static_cast<float>((seen->px.x() + 0.5) * size.width / camera.width - 0.5),
            static_cast<float>((seen->px.y() + 0.5) * size.height / camera.height - 0.5),
            static_cast<float>(factor[0]),
            static_cast<float>(factor[1]),
            static_cast<float>(factor[2])};
  }

  static cv::Mat4b Colours(const cv::Mat4f& sums) {
    constexpr uchar kOpaque = 255;
    cv::Mat4b colours(sums.size());
    for (int y = 0; y < sums.rows; ++y) {
      for (int x = 0; x < sums.cols; ++x) {
        const cv::Vec4f& sum = sums(y, x);
        const bool is_seen = sum[3] > 0;
        colours(y, x) = is_seen ? cv::Vec4b(cv::saturate_cast<uchar>(sum[0] / sum[3]),
                                            cv::saturate_cast<uchar>(sum[1] / sum[3]),
                                            cv::saturate_cast<uchar>(sum[2] / sum[3]), kOpaque)
                                : cv::Vec4b();
      }
    }
    return colours;
  }

  const MosaicPlan& plan_;
  const GroundGrid& grid_;
  int cells_a_step_;
  const MosaicOptions& options_;
  cv::Size stored_size_;
  PhotographCache cache_;
  int reach_ = 0;
  Eigen::Vector2d middle_;
  double half_diagonal2_ = 0;
  std::vector<cv::Size> sizes_;  ///< By view.
};

}  // namespace

void MosaicOptions::Check() const { CheckOptions("", *this); }

cv::Size MosaicSize(const GroundGrid& grid, int cells_a_step) {
  constexpr int kMost = 1 << 30;
  const double columns = 1.0 * (grid.columns - 1) * cells_a_step;
  const double rows = 1.0 * (grid.rows - 1) * cells_a_step;
  if (columns > kMost || rows > kMost) {
    throw Error("the orthophoto would have {:.0f} x {:.0f} pixels: expected a coarser resolution",
                columns, rows);
  }
  return {static_cast<int>(columns), static_cast<int>(rows)};
}

void MakeMosaic(const MosaicPlan& plan, int cells_a_step, Photographs* photographs,
                const WriteWindow& write, const std::function<void(double share)>& progress,
                const MosaicOptions& options) {
  options.Check();
  const cv::Rect all({}, MosaicSize(plan.surface.grid, cells_a_step));
  MosaicMaker maker(plan, cells_a_step, photographs, options);
  for (int y = 0; y < all.height; y += options.block_px) {
    for (int x = 0; x < all.width; x += options.block_px) {
      const cv::Rect window = cv::Rect(x, y, options.block_px, options.block_px) & all;
      const cv::Mat4b colours = maker.Make(window);
      if (!colours.empty()) write(window, colours);
      progress((static_cast<double>(y) * all.width +
                static_cast<double>(window.br().x) * window.height) /
               (static_cast<double>(all.width) * all.height));
    }
  }
}

}  // namespace deepuav
