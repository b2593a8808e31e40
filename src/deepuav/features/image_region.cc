#include "deepuav/features/image_region.h"

#include <algorithm>

namespace deepuav {

ImageRegion::ImageRegion(int width_px, int height_px, int cell_px)
    : cell_px_(cell_px),
      columns_((width_px + cell_px - 1) / cell_px),
      rows_((height_px + cell_px - 1) / cell_px),
      cells_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)) {}

int ImageRegion::CellOf(const Eigen::Vector2f& image_px) const {
  const auto along = [this](float px, int count) {
    return std::clamp(static_cast<int>(px) / cell_px_, 0, count - 1);
  };
  return along(image_px.y(), rows_) * columns_ + along(image_px.x(), columns_);
}

void ImageRegion::Add(const ImageRegion& other) {
  for (size_t i = 0; i < other.cells_.size(); ++i) {
    if (other.cells_[i]) cells_.at(i) = true;
  }
}

void ImageRegion::AddAround(int cell) {
  const int row = cell / columns_, column = cell % columns_;
  for (int y = std::max(0, row - 1); y <= std::min(rows_ - 1, row + 1); ++y) {
    for (int x = std::max(0, column - 1); x <= std::min(columns_ - 1, column + 1); ++x)
      Add(y * columns_ + x);
  }
}

bool ImageRegion::empty() const { return std::ranges::find(cells_, true) == cells_.end(); }

double ImageRegion::Share() const {
  if (cells_.empty()) return 0;
  return static_cast<double>(std::ranges::count(cells_, true)) / static_cast<double>(cells_.size());
}

bool ImageRegion::HasMoreThan(const ImageRegion& other) const {
  for (size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i] && (other.cells_.empty() || !other.cells_[i])) return true;
  }
  return false;
}

std::shared_ptr<const Features> Outside(const ImageRegion& region,
                                        const std::shared_ptr<const Features>& features) {
  const auto& keypoints = features->keypoints;
  const auto covered = [&region](const Keypoint& k) { return region.Covers(k.image_px); };
  if (std::ranges::none_of(keypoints, covered)) return features;
  auto outside = std::make_shared<Features>();
  outside->descriptors = Descriptors(features->descriptors.dimension());
  outside->descriptors.Reserve(features->size());
  for (int i = 0; i < features->size(); ++i) {
    const Keypoint& keypoint = keypoints[static_cast<size_t>(i)];
    if (covered(keypoint)) continue;
    outside->keypoints.push_back(keypoint);
    outside->descriptors.AppendFrom(features->descriptors, i);
  }
  return outside;
}

}  // namespace deepuav
