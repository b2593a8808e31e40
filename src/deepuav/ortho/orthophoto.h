#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "deepuav/base/option_bounds.h"
#include "deepuav/io/geodata/geotiff_file.h"
#include "deepuav/ortho/map_scene.h"
#include "deepuav/ortho/mosaic.h"
#include "deepuav/ortho/seams.h"

namespace deepuav {

struct OrthoOptions {
  /// Width of a cell, ground units; 0: of an orthophoto the median that a pixel of the photographs
  /// shows, of a DSM the grid's step.
  double resolution = 0;
  SurfaceOptions surface;
  ViewChoiceOptions views;
  SeamOptions seams;
  MosaicOptions mosaic;

  /// Throws Error for a value that cannot be.
  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("resolution", resolution, "",
          "width of a cell, ground units; 0: what the photographs show", Between(0, 1e9));
    visit.Part("surface", surface);
    visit.Part("views", views);
    visit.Part("seams", seams);
    visit.Part("mosaic", mosaic);
  }
};

/// A raster of the ground, ready to be made.
struct OrthoPlan {
  Surface surface;
  int cells_a_step = 1;
  GeoRaster raster;
  double gsd = 0;     ///< What a pixel of the scene's camera shows, ground units.
  ViewChoice choice;  ///< By node of the surface.

  /// A height a cell of the rows [first, last); NaN where nothing is known or no view sees it.
  cv::Mat1f Heights(int first, int last) const;
};

/// Surface, view choice and raster. `stored_width_px`: of the photographs as they are stored, whose
/// detail is wanted; nothing: a cell a node where no resolution is given. Throws Error where the
/// map tells no surface.
OrthoPlan PlanOrtho(const MapScene& scene, std::optional<int> stored_width_px,
                    const OrthoOptions& options);

/// Levels colours, chooses seams and makes the mosaic. Photographs that cannot be read are logged
/// and left out. `progress` is told the share that is done.
void MakeOrthophoto(const MapScene& scene, OrthoPlan* plan, Photographs* photographs,
                    const OrthoOptions& options, const WriteWindow& write,
                    const std::function<void(double share)>& progress);

/// The heights, some rows at a time.
void MakeDsm(const OrthoPlan& plan, const WriteWindow& write);

}  // namespace deepuav
