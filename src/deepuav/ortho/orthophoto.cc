#include "deepuav/ortho/orthophoto.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"

namespace deepuav {

void OrthoOptions::Check() const { CheckOptions("", *this); }

cv::Mat1f OrthoPlan::Heights(int first, int last) const {
  const int columns = MosaicSize(surface.grid, cells_a_step).width;
  cv::Mat1f heights(last - first, columns);
  const cv::Mat1f& nodes = surface.height;
  for (int row = first; row < last; ++row) {
    const int y = row / cells_a_step;
    const float v =
        (static_cast<float>(row % cells_a_step) + 0.5f) / static_cast<float>(cells_a_step);
    for (int column = 0; column < columns; ++column) {
      const int x = column / cells_a_step;
      const float u =
          (static_cast<float>(column % cells_a_step) + 0.5f) / static_cast<float>(cells_a_step);
      const bool is_seen = choice.count(y, x) > 0 || choice.count(y, x + 1) > 0 ||
                           choice.count(y + 1, x) > 0 || choice.count(y + 1, x + 1) > 0;
      const float off = (1 - v) * ((1 - u) * nodes(y, x) + u * nodes(y, x + 1)) +
                        v * ((1 - u) * nodes(y + 1, x) + u * nodes(y + 1, x + 1));
      heights(row - first, column) =
          is_seen ? static_cast<float>(surface.base + static_cast<double>(off))
                  : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return heights;
}

OrthoPlan PlanOrtho(const MapScene& scene, std::optional<int> stored_width_px,
                    const OrthoOptions& options) {
  options.Check();
  OrthoPlan plan;
  const double width = scene.scene.camera.width;
  plan.gsd = MedianGsd(scene.scene, scene.landmarks);
  double unit = options.resolution;
  if (unit == 0 && stored_width_px) unit = plan.gsd * width / *stored_width_px;
  plan.surface = FitSurface(scene.LandmarksOnGround(), unit, options.surface);
  const GroundGrid& grid = plan.surface.grid;
  if (unit > 0) plan.cells_a_step = static_cast<int>(std::lround(grid.step / unit));
  const double cell = grid.step / plan.cells_a_step;
  const cv::Size size = MosaicSize(grid, plan.cells_a_step);
  plan.raster = {.columns = size.width,
                 .rows = size.height,
                 .west = grid.west,
                 .north = grid.north,
                 .cell = cell,
                 .epsg = scene.scene.frame.epsg};
  const double wanted = stored_width_px ? cell * *stored_width_px / width : cell;
  plan.choice = ChooseViews(scene.scene, plan.surface, std::max(plan.gsd, wanted), options.views);
  return plan;
}

void MakeOrthophoto(const MapScene& scene, OrthoPlan* plan, Photographs* photographs,
                    const OrthoOptions& options, const WriteWindow& write,
                    const std::function<void(double share)>& progress) {
  const NodeColours colours = ReadNodeColours(
      scene.scene, plan->surface, photographs, plan->gsd, &plan->choice,
      [](int /*view*/, const std::string& why) { Log().warn("left out: {}", why); });
  const ColourLevels levels = LevelColours(scene.scene.views.size(), plan->choice, colours);
  const cv::Mat1i view_of_node =
      ChooseSeams(plan->surface.grid, plan->choice, colours, levels, options.seams);
  MakeMosaic({scene.scene, plan->surface, plan->choice, levels, view_of_node}, plan->cells_a_step,
             photographs, write, progress, options.mosaic);
}

void MakeDsm(const OrthoPlan& plan, const WriteWindow& write) {
  constexpr int kRows = 256;
  for (int row = 0; row < plan.raster.rows; row += kRows) {
    const int last = std::min(row + kRows, plan.raster.rows);
    write({0, row, plan.raster.columns, last - row}, plan.Heights(row, last));
  }
}

}  // namespace deepuav
