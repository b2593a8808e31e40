#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/ortho/colour_levels.h"
#include "deepuav/ortho/photographs.h"

namespace deepuav {

struct MosaicOptions {
  double feather_nodes = 1.2;  ///< Standard deviation of the transition at a seam, in nodes.
  int block_px = 2048;         ///< Side of what is in memory of the mosaic at once.
  double cache_mb = 200;       ///< Of photographs that stay decoded.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("feather_nodes", feather_nodes, "", "standard deviation of the transition at a seam",
          Between(0, 100));
    visit("block_px", block_px, "px", "side of what is in memory of the mosaic at once",
          Between(16, 16384));
    visit("cache_mb", cache_mb, "MB", "of photographs that stay decoded", Between(0, 1e6));
  }
};

/// All that tells which pixel of which photograph shows a place.
struct MosaicPlan {
  const OrthoScene& scene;
  const Surface& surface;
  const ViewChoice& choice;
  const ColourLevels& levels;
  const cv::Mat1i& view_of_node;
};

/// Of a raster whose cells are `surface.grid.step / cells_a_step` wide, over the whole grid.
cv::Size MosaicSize(const GroundGrid& grid, int cells_a_step);

/// Takes a window of the mosaic and what lies there: blue, green, red, alpha 0 or 255.
using WriteWindow = std::function<void(const cv::Rect& window, const cv::Mat& pixels)>;

/// Makes the mosaic block by block, so that memory does not grow with it. Blocks in which nothing
/// is seen are not written. `progress` is told the share that is done.
void MakeMosaic(const MosaicPlan& plan, int cells_a_step, Photographs* photographs,
                const WriteWindow& write, const std::function<void(double share)>& progress,
                const MosaicOptions& options = {});

}  // namespace deepuav
