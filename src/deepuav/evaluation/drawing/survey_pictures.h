#pragma once

#include <memory>
#include <nlohmann/json.hpp>

#include "deepuav/base/option_bounds.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/maps/map_file.h"

namespace deepuav {

struct SurveyPictureOptions {
  int width_px = 900;      ///< Of the orthophoto.
  int quality = 80;        ///< Of its compression, 0 to 100.
  int error_columns = 40;  ///< Cells of the reprojection errors over the image's width.

  /// Throws Error for a value that cannot be.
  void Check() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("width_px", width_px, "px", "width of the orthophoto", Between(16, 16'384));
    visit("quality", quality, "", "of its compression", Between(0, 100));
    visit("error_columns", error_columns, "", "cells of the reprojection errors over the image",
          Between(1, 1000));
  }
};

/// A survey for a page: {"about", "aspect": width over height of the ground shown, "orthophoto",
/// "overlap": pictures as data URI, "overlap_colors": CSS by photographs from 1, the last for more,
/// "cameras": [[x, y]] as shares of the pictures' width and height, "errors": {"picture",
/// "aspect", "most_px", "median_px"}}. Without `dataset` there is no "orthophoto". Throws Error
/// where the map tells no surface, or the dataset has none of its images.
nlohmann::json SurveyPictures(const LoadedAtlas& loaded, MapId map,
                              std::unique_ptr<Dataset> dataset,
                              const SurveyPictureOptions& options = {});

}  // namespace deepuav
