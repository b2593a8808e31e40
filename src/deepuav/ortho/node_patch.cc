#include "deepuav/ortho/node_patch.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace deepuav {
namespace {

using Values = NodePatch::Values;

Values Between(const Values& a, const Values& b, float share) {
  Values between;
  for (size_t i = 0; i < between.size(); ++i) between[i] = a[i] + share * (b[i] - a[i]);
  return between;
}

/// The cells of `window` that lie between nodes of the patch.
cv::Rect CellsOf(const NodePatch& patch, int cells_a_step, const cv::Rect& window) {
  const cv::Rect cells(patch.nodes.x * cells_a_step, patch.nodes.y * cells_a_step,
                       (patch.nodes.width - 1) * cells_a_step,
                       (patch.nodes.height - 1) * cells_a_step);
  return cells & window;
}

/// The patch's values at the cells of one row.
class RowOfCells {
 public:
  RowOfCells(const NodePatch& patch, int cells_a_step, int row)
      : first_(patch.nodes.x), cells_a_step_(cells_a_step) {
    const float at = (static_cast<float>(row) + 0.5f) / static_cast<float>(cells_a_step);
    const int above = row / cells_a_step;
    const auto width = static_cast<size_t>(patch.nodes.width);
    const size_t start = static_cast<size_t>(above - patch.nodes.y) * width;
    nodes_.resize(width);
    for (size_t i = 0; i < width; ++i) {
      nodes_[i] = Between(patch.values[start + i], patch.values[start + width + i],
                          at - static_cast<float>(above));
    }
  }

  Values At(int column) const {
    const int left = column / cells_a_step_;
    const float share = (static_cast<float>(column - left * cells_a_step_) + 0.5f) /
                        static_cast<float>(cells_a_step_);
    const auto index = static_cast<size_t>(left - first_);
    return Between(nodes_[index], nodes_[index + 1], share);
  }

 private:
  int first_, cells_a_step_;
  std::vector<Values> nodes_;
};

/// Some rows of cells at once, for the library's resampling.
void AddRows(const NodePatch& patch, const cv::Mat3b& photograph, int cells_a_step,
             const cv::Rect& rows, const cv::Point& origin, cv::Mat4f* sums) {
  cv::Mat2f places(rows.size());
  cv::Mat4f factors(rows.size());  // of the weight last
  const auto right = static_cast<float>(photograph.cols - 1);
  const auto bottom = static_cast<float>(photograph.rows - 1);
  for (int y = 0; y < rows.height; ++y) {
    const RowOfCells row(patch, cells_a_step, rows.y + y);
    for (int x = 0; x < rows.width; ++x) {
      const Values values = row.At(rows.x + x);
      const auto& [weight, px, py, blue, green, red] = values;
      const bool is_inside = px >= 0 && py >= 0 && px <= right && py <= bottom;
      places(y, x) = {px, py};
      factors(y, x) = {blue, green, red, is_inside ? weight : 0};
    }
  }
  cv::Mat3b colours;
  cv::remap(photograph, colours, places, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  for (int y = 0; y < rows.height; ++y) {
    cv::Vec4f* sum = (*sums)[rows.y + y - origin.y] + (rows.x - origin.x);
    for (int x = 0; x < rows.width; ++x) {
      const cv::Vec4f& factor = factors(y, x);
      const cv::Vec3b& colour = colours(y, x);
      for (int i = 0; i < 3; ++i)
        sum[x][i] += factor[3] * factor[i] * static_cast<float>(colour[i]);
      sum[x][3] += factor[3];
    }
  }
}

}  // namespace

void AddPhotograph(const NodePatch& patch, const cv::Mat3b& photograph, int cells_a_step,
                   const cv::Rect& window, cv::Mat4f* sums) {
  constexpr int kBandRows = 32;
  const cv::Rect cells = CellsOf(patch, cells_a_step, window);
  if (cells.empty() || photograph.empty()) return;
  const int bands = (cells.height + kBandRows - 1) / kBandRows;
  cv::parallel_for_({0, bands}, [&](const cv::Range& range) {
    for (int band = range.start; band < range.end; ++band) {
      cv::Rect rows = cells;
      rows.y += band * kBandRows;
      rows.height = std::min(kBandRows, cells.br().y - rows.y);
      AddRows(patch, photograph, cells_a_step, rows, window.tl(), sums);
    }
  });
}

}  // namespace deepuav
