#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/ortho/ground_grid.h"

namespace deepuav {

struct SurfaceOptions {
  double step_over_spacing = 0.5;  ///< Of the grid, over the typical spacing of landmarks.
  double max_nodes = 1.5e6;        ///< Of the grid; the step grows where there would be more.
  int min_landmarks = 30;          ///< Fewer make no surface.
  int neighbours = 16;             ///< Landmarks that tell whether one of them is an outlier...
  int support = 10;                ///< ...and those through which the surface leads at a node.
  double max_isolation = 8;        ///< Spacing about a landmark over the typical one.
  double max_off = 4;              ///< Height off its neighbours' median, over their deviation.
  double support_spacings = 3;     ///< To the nearest landmark; beyond, gaps are filled smoothly.
  double margin_spacings = 6;      ///< How far the surface goes beyond the outermost landmarks.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("step_over_spacing", step_over_spacing, "", "step of the grid over that of landmarks",
          Above(0, 100));
    visit("max_nodes", max_nodes, "", "of the grid; its step grows where there would be more",
          Between(100, 1e8));
    visit("min_landmarks", min_landmarks, "", "fewer make no surface", Between(3, 1e6));
    visit("neighbours", neighbours, "", "landmarks that tell whether one of them is an outlier",
          Between(3, 1000));
    visit("support", support, "", "landmarks through which the surface leads at a node",
          Between(3, 1000));
    visit("max_isolation", max_isolation, "", "spacing about a landmark over the typical one",
          Above(0, 1e6));
    visit("max_off", max_off, "", "height off the neighbours' median, over their deviation",
          Above(0, 1e6));
    visit("support_spacings", support_spacings, "", "to a landmark; beyond, gaps are filled",
          Above(0, 1e6));
    visit("margin_spacings", margin_spacings, "", "of the surface beyond the last landmarks",
          Between(0, 1e6));
  }
};

/// The ground as one height a place.
struct Surface {
  GroundGrid grid;
  cv::Mat1f height;   ///< By row and column; NaN beyond the landmarks' margin.
  double base = 0;    ///< To be added to `height`, so that floats hold millimetres.
  int landmarks = 0;  ///< It leads through...
  int outliers = 0;   ///< ...and those left out.

  bool Has(int column, int row) const { return height(row, column) == height(row, column); }
  Eigen::Vector3d Node(int column, int row) const {
    const Eigen::Vector2d place = grid.At(column, row);
    return {place.x(), place.y(), base + static_cast<double>(height(row, column))};
  }
};

/// A surface through landmarks (ground coordinates): outliers left out, at each node a plane that
/// fits the nearest landmarks robustly, gaps filled smoothly, nothing far outside their hull. The
/// step is the one that the options say, as a multiple of `unit` (the cell of a raster) if that is
/// not 0. Throws Error where landmarks are too few.
Surface FitSurface(const std::vector<Eigen::Vector3d>& landmarks, double unit,
                   const SurfaceOptions& options = {});

}  // namespace deepuav
