#include "deepuav/ortho/map_scene.h"

#include <algorithm>
#include <map>
#include <optional>

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

/// The frames of a dataset by their images' names; of several of one name none.
std::map<std::string, std::optional<int>> FramesByName(const Dataset& dataset) {
  std::map<std::string, std::optional<int>> frames;
  for (int frame = 0; frame < dataset.size(); ++frame) {
    const auto [place, is_new] = frames.emplace(dataset.ImageName(frame), frame);
    if (!is_new) place->second.reset();
  }
  return frames;
}

std::vector<std::optional<int>> FramesOf(const MapScene& scene, const Dataset& dataset) {
  const std::map<std::string, std::optional<int>> by_name = FramesByName(dataset);
  std::vector<std::optional<int>> frames;
  for (size_t i = 0; i < scene.times.size(); ++i) {
    const std::string& name = scene.names[i];
    std::optional<int>& frame = frames.emplace_back(FrameAt(dataset, scene.times[i]));
    if (name.empty() || (frame && dataset.ImageName(*frame) == name)) continue;
    const auto found = by_name.find(name);
    frame = found == by_name.end() ? std::nullopt : found->second;
  }
  return frames;
}

class DatasetPhotographs : public Photographs {
 public:
  DatasetPhotographs(std::unique_ptr<Dataset> dataset, std::vector<std::optional<int>> frames,
                     std::vector<std::string> names)
      : dataset_(std::move(dataset)), frames_(std::move(frames)), names_(std::move(names)) {}

  cv::Size stored_size() const override {
    return {dataset_->stored_camera().width, dataset_->stored_camera().height};
  }
  cv::Mat3b Load(int view, const cv::Size& size) override {
    const std::optional<int>& frame = frames_[static_cast<size_t>(view)];
    if (!frame) throw Error("{}: is not among the images", names_[static_cast<size_t>(view)]);
    return dataset_->LoadColour(*frame, size);
  }

 private:
  std::unique_ptr<Dataset> dataset_;
  std::vector<std::optional<int>> frames_;
  std::vector<std::string> names_;
};

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
    const auto name = loaded.origin.image_names.find(keyframe.id);
    scene.names.push_back(name == loaded.origin.image_names.end() ? "" : name->second);
    scene.times.push_back(keyframe.frame.time);
    centres.push_back(keyframe.cam_from_world.InverseTranslation());
  });
  if (centres.empty()) throw Error("map {}: has no keyframes", id.value);
  scene.landmarks = ReliableLandmarks(map);
  scene.scene.frame = MakeGroundFrame(loaded.atlas.GaugeOf(id), scene.landmarks, centres);
  return scene;
}

std::unique_ptr<Photographs> PhotographsOf(const MapScene& scene,
                                           std::unique_ptr<Dataset> dataset) {
  std::vector<std::optional<int>> frames = FramesOf(scene, *dataset);
  if (std::none_of(frames.begin(), frames.end(), [](const auto& frame) { return frame; })) {
    throw Error("{}: is none of the {} images of the map: expected the images that made it",
                dataset->Name(0), frames.size());
  }
  return std::make_unique<DatasetPhotographs>(std::move(dataset), std::move(frames), scene.names);
}

}  // namespace deepuav
