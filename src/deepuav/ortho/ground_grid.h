#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace deepuav {

/// Nodes in equal steps over the ground, the first in the north-west; ground coordinates.
struct GroundGrid {
  double west = 0, north = 0;  ///< Of the first node.
  double step = 0;
  int columns = 0, rows = 0;

  Eigen::Vector2d At(int column, int row) const {
    return {west + column * step, north - row * step};
  }
  /// Column and row of a place, with fractions.
  Eigen::Vector2d NodeOf(const Eigen::Vector2d& place) const {
    return {(place.x() - west) / step, (north - place.y()) / step};
  }
  bool Holds(int column, int row) const {
    return column >= 0 && column < columns && row >= 0 && row < rows;
  }
  size_t Index(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column);
  }
  size_t size() const { return static_cast<size_t>(rows) * static_cast<size_t>(columns); }
};

}  // namespace deepuav
