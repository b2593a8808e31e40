#include "deepuav/api/map.h"

#include <utility>

#include "deepuav/api/conversions.h"
#include "deepuav/api/guarded.h"
#include "deepuav/io/maps/map_file.h"

namespace deepuav::api {

struct Map::Data {
  LoadedAtlas loaded;
};

Map::Map(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Map::Map(Map&& other) noexcept = default;
Map& Map::operator=(Map&& other) noexcept = default;
Map::~Map() = default;

Map Map::Load(const std::string& file) {
  return Guarded([&] { return Map(std::make_unique<Data>(Data{ReadMapFile(file)})); });
}

std::vector<Keyframe> Map::Keyframes() const {
  return Guarded(
      [&] { return KeyframesOf(data_->loaded.atlas, data_->loaded.origin.image_names); });
}

std::vector<Landmark> Map::Landmarks() const {
  return Guarded([&] { return LandmarksOf(data_->loaded.atlas); });
}

std::vector<MapInfo> Map::Maps() const {
  return Guarded([&] { return MapsOf(data_->loaded.atlas); });
}

Camera Map::MapCamera() const {
  return Guarded([&] { return ToApi(data_->loaded.camera); });
}

}  // namespace deepuav::api
