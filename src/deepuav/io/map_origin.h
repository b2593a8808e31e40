#pragma once

#include <map>
#include <string>

#include "deepuav/io/dataset.h"
#include "deepuav/map/atlas.h"

namespace deepuav {

/// What made the maps of a file, and of which images.
struct MapOrigin {
  std::string program;   ///< Version of the program that wrote the file.
  std::string features;  ///< The extractor's description: which network, with its SHA-256.
  std::string matcher;   ///< The matcher's description.
  std::map<KeyframeId, std::string> image_names;  ///< File names without their folders.
};

/// Names the images of the atlas's keyframes that have no name yet, by their times in the dataset
/// they come from. Those that are not in it stay without.
void NameImages(const Atlas& atlas, const Dataset& dataset,
                std::map<KeyframeId, std::string>* image_names);

}  // namespace deepuav
