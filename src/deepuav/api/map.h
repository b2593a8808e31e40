#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deepuav/api/types.h"

namespace deepuav::api {

/// The maps of a map.deepuav file. Const use is thread-safe.
class DEEPUAV_API Map {
 public:
  /// Throws Error naming the file, for one that is missing, damaged or no map.
  static Map Load(const std::string& file);
  Map(Map&& other) noexcept;
  Map& operator=(Map&& other) noexcept;
  ~Map();

  /// Of all maps of the file, by map and id.
  std::vector<Keyframe> Keyframes() const;
  std::vector<Landmark> Landmarks() const;
  std::vector<MapInfo> Maps() const;
  /// That made them.
  Camera MapCamera() const;

 private:
  struct Data;
  explicit Map(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

}  // namespace deepuav::api
