#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/features/features.h"

namespace deepuav {

/// Finds the key points near a pixel. Refers to the features, which must outlive it. Const use is
/// thread-safe.
class KeypointGrid {
 public:
  explicit KeypointGrid(const Features& features);

  /// Appends to `found` (cleared first) the indices of key points within `radius_px` of `px`, in a
  /// fixed order.
  void Find(const Eigen::Vector2d& px, double radius_px, std::vector<int>* found) const;

 private:
  static constexpr float kCellPx = 16;

  int Column(float x) const;
  int Row(float y) const;

  const Features& features_;
  Eigen::Vector2f origin_px_ = Eigen::Vector2f::Zero();
  int columns_ = 1, rows_ = 1;
  std::vector<int>
      cell_start_;  ///< Key points of cell c: order_[cell_start_[c]] up to cell_start_[c + 1].
  std::vector<int> order_;
};

}  // namespace deepuav
