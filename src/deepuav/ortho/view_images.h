#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deepuav/base/time.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/ortho/photographs.h"

namespace deepuav {

/// The images of a map's views, its keyframes in their order.
struct ViewImages {
  std::vector<std::string> names;  ///< Empty where it is not known.
  std::vector<Timestamp> times;
};

ViewImages ViewImagesOf(const LoadedAtlas& loaded, MapId map);

/// The views' images out of a dataset that has them, by name and time. Throws Error where it has
/// none of them; `dataset` stays with it.
std::unique_ptr<Photographs> PhotographsOf(const ViewImages& images,
                                           std::unique_ptr<Dataset> dataset);

}  // namespace deepuav
