#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "deepuav/base/option_bounds.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/geodata/map_origin.h"
#include "deepuav/map/map.h"

namespace deepuav {

struct PictureOptions {
  int pairs = 6;          ///< Neighbouring keyframes shown, spread evenly over the map.
  int width_px = 560;     ///< Images are reduced to this width.
  int jpeg_quality = 78;  ///< 0 to 100.

  /// Throws Error for a value that cannot be.
  void Check() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("pairs", pairs, "", "pairs of neighbouring keyframes shown", Between(0, 100'000));
    visit("width_px", width_px, "px", "width to which images are reduced", Between(1, 16'384));
    visit("jpeg_quality", jpeg_quality, "", "quality of the images", Between(0, 100));
  }
};

/// Pairs of keyframes that follow one another, their key points and the landmarks they share, for a
/// page: [{"shared": n, "views": [view, view], "matches": u16 pairs of key points}], where a view
/// is
/// {"time_s", "keyframe", "width", "height", "points": u16 x and y, "mapped": u8, "image": JPEG as
/// data URI}. Without `dataset`, and for frames it no longer has or has under another name than
/// `image_names` says, there is no "image".
nlohmann::json KeyframePictures(const Map& map, const Camera& camera, const ImageNames& image_names,
                                Dataset* dataset, const PictureOptions& options = {});

}  // namespace deepuav
