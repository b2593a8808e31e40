#include "deepuav/features/keypoint_grid.h"

#include <algorithm>
#include <numeric>

namespace deepuav {
namespace {

constexpr float kLastCell =
    1023;  ///< What lies farther, as in a map file of whatever origin, shares it.

}  // namespace

KeypointGrid::KeypointGrid(const Features& features) : features_(features) {
  Eigen::Vector2f low = Eigen::Vector2f::Zero(), high = Eigen::Vector2f::Zero();
  for (int i = 0; i < features.size(); ++i) {
    const Eigen::Vector2f& px = features.keypoints[static_cast<size_t>(i)].px;
    low = i == 0 ? px : low.cwiseMin(px);
    high = i == 0 ? px : high.cwiseMax(px);
  }
  origin_px_ = low;
  columns_ = 1 + static_cast<int>(std::min((high.x() - low.x()) / kCellPx, kLastCell));
  rows_ = 1 + static_cast<int>(std::min((high.y() - low.y()) / kCellPx, kLastCell));

  cell_start_.assign(static_cast<size_t>(columns_ * rows_) + 1, 0);
  const auto cell_of = [this](const Keypoint& k) {
    return static_cast<size_t>(Row(k.px.y()) * columns_ + Column(k.px.x()));
  };
  for (const Keypoint& keypoint : features.keypoints) ++cell_start_[cell_of(keypoint) + 1];
  std::partial_sum(cell_start_.begin(), cell_start_.end(), cell_start_.begin());
  order_.resize(features.keypoints.size());
  std::vector<int> next(cell_start_.begin(), cell_start_.end() - 1);
  for (int i = 0; i < features.size(); ++i) {
    const size_t cell = cell_of(features.keypoints[static_cast<size_t>(i)]);
    order_[static_cast<size_t>(next[cell]++)] = i;
  }
}

int KeypointGrid::Column(float x) const {
  // Clamped before the conversion: far outside, the column has no int.
  return static_cast<int>(
      std::clamp((x - origin_px_.x()) / kCellPx, 0.0f, static_cast<float>(columns_ - 1)));
}

int KeypointGrid::Row(float y) const {
  return static_cast<int>(
      std::clamp((y - origin_px_.y()) / kCellPx, 0.0f, static_cast<float>(rows_ - 1)));
}

void KeypointGrid::Find(const Eigen::Vector2d& px, double radius_px,
                        std::vector<int>* found) const {
  found->clear();
  const Eigen::Vector2f centre = px.cast<float>();
  const auto radius = static_cast<float>(radius_px);
  const int first_column = Column(centre.x() - radius), last_column = Column(centre.x() + radius);
  const int first_row = Row(centre.y() - radius), last_row = Row(centre.y() + radius);
  for (int row = first_row; row <= last_row; ++row) {
    const auto begin =
        static_cast<size_t>(cell_start_[static_cast<size_t>(row * columns_ + first_column)]);
    const auto end =
        static_cast<size_t>(cell_start_[static_cast<size_t>(row * columns_ + last_column) + 1]);
    for (size_t i = begin; i < end; ++i) {
      const Eigen::Vector2f& candidate = features_.keypoints[static_cast<size_t>(order_[i])].px;
      if ((candidate - centre).squaredNorm() <= radius * radius) found->push_back(order_[i]);
    }
  }
}

}  // namespace deepuav
