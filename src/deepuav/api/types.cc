#include "deepuav/api/types.h"

#include "deepuav/api/conversions.h"
#include "deepuav/api/guarded.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/datasets/euroc_sensor.h"
#include "deepuav/io/files/yaml_map.h"

namespace deepuav::api {

// Here, so that the library alone holds what tells the type from others.
Error::Error(const std::string& message) : std::runtime_error(message) {}
Error::Error(const Error& other) = default;
Error::~Error() = default;

Camera ReadCamera(const std::string& file) {
  return Guarded([&] {
    const bool is_euroc = YamlMap::Read(file).Has("T_BS");
    return ToApi(is_euroc ? ReadEurocSensor(file).camera : ReadCompleteCameraFile(file).camera);
  });
}

}  // namespace deepuav::api
