#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

namespace deepuav {

/// What is known of one view at the nodes of a rectangle, to be interpolated between them.
struct NodePatch {
  /// Weight, place in the photograph (x, y), factors of blue, green and red.
  static constexpr int kChannels = 6;
  using Values = std::array<float, kChannels>;

  cv::Rect nodes;
  std::vector<Values> values;  ///< By row and column of `nodes`.

  Values& At(int column, int row) {
    return values[static_cast<size_t>(row - nodes.y) * static_cast<size_t>(nodes.width) +
                  static_cast<size_t>(column - nodes.x)];
  }
};

/// Adds a photograph, weighted, to the sums of blue, green, red and weight of the cells of
/// `window`. The cell in column c and row r lies at node ((c + 0.5) / cells_a_step, ...).
void AddPhotograph(const NodePatch& patch, const cv::Mat3b& photograph, int cells_a_step,
                   const cv::Rect& window, cv::Mat4f* sums);

}  // namespace deepuav
