#include "deepuav/ortho/map_scene.h"

#include "deepuav/base/error.h"
#include "deepuav/io/geodata/map_origin.h"

namespace deepuav {
namespace {

/// Of two views alone nothing tells a wrong match along the epipolar line.
std::vector<Eigen::Vector3d> ReliableLandmarks(const Map& map) {
  constexpr size_t kViews = 3;
  std::vector<Eigen::Vector3d> all, reliable;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    all.push_back(landmark.position_world);
    if (landmark.observations.size() >= kViews) reliable.push_back(landmark.position_world);
  });
  return 2 * reliable.size() >= all.size() ? reliable : all;
}

}  // namespace

std::vector<Eigen::Vector3d> MapScene::LandmarksOnGround() const {
  std::vector<Eigen::Vector3d> ground;
  ground.reserve(landmarks.size());
  for (const Eigen::Vector3d& landmark : landmarks)
    ground.push_back(scene.frame.ground_from_world(landmark));
  return ground;
}

MapScene SceneOf(const LoadedAtlas& loaded, MapId id) {
  const Map& map = loaded.atlas.At(id);
  MapScene scene;
  scene.scene.camera = loaded.camera;
  std::vector<Eigen::Vector3d> centres;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    scene.scene.views.push_back({keyframe.cam_from_world, keyframe.motion()});
    centres.push_back(keyframe.cam_from_world.InverseTranslation());
  });
  if (centres.empty()) throw Error("map {}: has no keyframes", id.value);
  scene.images = ViewImagesOf(loaded, id);
  scene.landmarks = ReliableLandmarks(map);
  scene.scene.frame = MakeGroundFrame(loaded.atlas.GaugeOf(id), scene.landmarks, centres);
  return scene;
}

}  // namespace deepuav
