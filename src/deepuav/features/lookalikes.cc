#include "deepuav/features/lookalikes.h"

#include <algorithm>
#include <numeric>

namespace deepuav {
namespace {

constexpr int kRowsAtOnce = 128;  ///< Of similarities, which are a matrix in all.

Descriptors Rows(const Descriptors& all, int first, int last) {
  Descriptors rows(all.dimension());
  rows.Reserve(last - first);
  for (int i = first; i < last; ++i) rows.AppendFrom(all, i);
  return rows;
}

}  // namespace

std::vector<int> CountLookalikes(const Features& features, double similarity, double apart_px) {
  const int count = features.size();
  const auto at = [&](int i) -> const Eigen::Vector2f& {
    return features.keypoints[static_cast<size_t>(i)].image_px;
  };
  const auto least = static_cast<float>(similarity);
  const auto apart_squared = static_cast<float>(apart_px * apart_px);
  std::vector<int> lookalikes(static_cast<size_t>(count), 0);
  std::vector<float> similarities;
  for (int first = 0; first < count; first += kRowsAtOnce) {
    const int last = std::min(count, first + kRowsAtOnce);
    similarities.resize(static_cast<size_t>(last - first) * static_cast<size_t>(count));
    Rows(features.descriptors, first, last).SimilarityMatrix(features.descriptors, similarities);
    const float* to = similarities.data();
    for (int i = first; i < last; ++i, to += count) {
      for (int j = 0; j < count; ++j) {
        if (to[j] > least && (at(i) - at(j)).squaredNorm() > apart_squared)
          ++lookalikes[static_cast<size_t>(i)];
      }
    }
  }
  return lookalikes;
}

double ShareWithLookalikes(const std::vector<int>& lookalikes) {
  if (lookalikes.empty()) return 0;
  const auto with = std::ranges::count_if(lookalikes, [](int others) { return others > 0; });
  return static_cast<double>(with) / static_cast<double>(lookalikes.size());
}

Features MostDistinct(const Features& features, const std::vector<int>& lookalikes, int count) {
  std::vector<int> order(lookalikes.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int i) { return lookalikes[static_cast<size_t>(i)]; });
  order.resize(std::min(order.size(), static_cast<size_t>(count)));
  std::ranges::sort(order);
  Features distinct{{}, Descriptors(features.descriptors.dimension())};
  distinct.keypoints.reserve(order.size());
  distinct.descriptors.Reserve(static_cast<int>(order.size()));
  for (const int i : order) {
    distinct.keypoints.push_back(features.keypoints[static_cast<size_t>(i)]);
    distinct.descriptors.AppendFrom(features.descriptors, i);
  }
  return distinct;
}

}  // namespace deepuav
