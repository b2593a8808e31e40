#include "deepuav/ortho/gap_filling.h"

#include <opencv2/imgproc.hpp>

namespace deepuav {
namespace {

bool IsKnown(float value) { return value == value; }

/// Each cell the mean of the known ones of its two by two.
cv::Mat1f Halved(const cv::Mat1f& fine) {
  cv::Mat1f coarse((fine.rows + 1) / 2, (fine.cols + 1) / 2);
  for (int row = 0; row < coarse.rows; ++row) {
    for (int column = 0; column < coarse.cols; ++column) {
      float sum = 0;
      int count = 0;
      for (int y = 2 * row; y < std::min(2 * row + 2, fine.rows); ++y) {
        for (int x = 2 * column; x < std::min(2 * column + 2, fine.cols); ++x) {
          if (!IsKnown(fine(y, x))) continue;
          sum += fine(y, x);
          ++count;
        }
      }
      // Of none this is NaN.
      coarse(row, column) = sum / static_cast<float>(count);
    }
  }
  return coarse;
}

/// Moves what is not `known` towards the mean of its neighbours.
void Relax(const cv::Mat1b& known, cv::Mat1f* values) {
  constexpr int kSweeps = 30;
  cv::Mat1f& heights = *values;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int y = 0; y < heights.rows; ++y) {
      for (int x = 0; x < heights.cols; ++x) {
        if (known(y, x)) continue;
        const int left = std::max(x - 1, 0), right = std::min(x + 1, heights.cols - 1);
        const int above = std::max(y - 1, 0), below = std::min(y + 1, heights.rows - 1);
        heights(y, x) =
            (heights(y, left) + heights(y, right) + heights(above, x) + heights(below, x)) / 4;
      }
    }
  }
}

}  // namespace

void FillGaps(cv::Mat1f* values) {
  const cv::Mat1b known = *values == *values;
  const int count = cv::countNonZero(known);
  if (count == 0 || count == static_cast<int>(values->total())) return;
  cv::Mat1f coarse = Halved(*values);
  FillGaps(&coarse);
  cv::Mat1f fine;
  cv::resize(coarse, fine, values->size(), 0, 0, cv::INTER_LINEAR);
  values->copyTo(fine, known);
  Relax(known, &fine);
  *values = fine;
}

}  // namespace deepuav
