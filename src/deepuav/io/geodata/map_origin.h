#pragma once

#include <map>
#include <optional>
#include <string>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/map/atlas.h"

namespace deepuav {

/// File names without their folders.
using ImageNames = std::map<KeyframeId, std::string>;

/// What made the maps of a file, and of which images.
struct MapOrigin {
  std::string program;   ///< Version of the program that wrote the file.
  std::string features;  ///< The extractor's description: which network, with its SHA-256.
  std::string matcher;   ///< The matcher's description.
  ImageNames image_names;
};

/// The frame of this very time, if there is one: times grow with the frames' numbers.
std::optional<int> FrameAt(const Dataset& dataset, Timestamp time);

/// Names the images of the atlas's keyframes that have no name yet, by their times in the dataset
/// they come from. Those that are not in it stay without.
void NameImages(const Atlas& atlas, const Dataset& dataset, ImageNames* image_names);

}  // namespace deepuav
