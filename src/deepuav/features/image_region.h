#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "deepuav/features/features.h"

namespace deepuav {

/// Part of a camera's image, in square cells. Value type.
class ImageRegion {
 public:
  ImageRegion() = default;
  /// Nothing of an image of this size.
  ImageRegion(int width_px, int height_px, int cell_px);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  /// The cell's number, row-major, of a pixel of the image as taken; of one beyond its edge the
  /// nearest.
  int CellOf(const Eigen::Vector2f& image_px) const;

  /// All of another region of the same image.
  void Add(const ImageRegion& other);
  void Add(int cell) { cells_.at(static_cast<size_t>(cell)) = true; }
  /// The cell and those that touch it.
  void AddAround(int cell);
  bool Covers(const Eigen::Vector2f& image_px) const {
    return !cells_.empty() && cells_[static_cast<size_t>(CellOf(image_px))];
  }
  bool empty() const;
  /// Of the image's cells, in 0..1.
  double Share() const;
  /// Whether there is anything in it that is not in `other`, of the same image.
  bool HasMoreThan(const ImageRegion& other) const;

 private:
  int cell_px_ = 1, columns_ = 0, rows_ = 0;
  std::vector<bool> cells_;
};

/// Those of the features that lie outside of the region; the same ones where all do.
std::shared_ptr<const Features> Outside(const ImageRegion& region,
                                        const std::shared_ptr<const Features>& features);

}  // namespace deepuav
