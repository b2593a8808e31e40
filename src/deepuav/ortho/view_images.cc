#include "deepuav/ortho/view_images.h"

#include <algorithm>
#include <map>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/io/geodata/map_origin.h"

namespace deepuav {
namespace {

/// The frames of a dataset by their images' names; of several of one name none.
std::map<std::string, std::optional<int>> FramesByName(const Dataset& dataset) {
  std::map<std::string, std::optional<int>> frames;
  for (int frame = 0; frame < dataset.size(); ++frame) {
    const auto [place, is_new] = frames.emplace(dataset.ImageName(frame), frame);
    if (!is_new) place->second.reset();
  }
  return frames;
}

std::vector<std::optional<int>> FramesOf(const ViewImages& images, const Dataset& dataset) {
  const std::map<std::string, std::optional<int>> by_name = FramesByName(dataset);
  std::vector<std::optional<int>> frames;
  for (size_t i = 0; i < images.times.size(); ++i) {
    const std::string& name = images.names[i];
    std::optional<int>& frame = frames.emplace_back(FrameAt(dataset, images.times[i]));
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

ViewImages ViewImagesOf(const LoadedAtlas& loaded, MapId map) {
  ViewImages images;
  loaded.atlas.At(map).keyframes().ForEach([&](const Keyframe& keyframe) {
    const auto name = loaded.origin.image_names.find(keyframe.id);
    images.names.push_back(name == loaded.origin.image_names.end() ? "" : name->second);
    images.times.push_back(keyframe.frame.time);
  });
  return images;
}

std::unique_ptr<Photographs> PhotographsOf(const ViewImages& images,
                                           std::unique_ptr<Dataset> dataset) {
  std::vector<std::optional<int>> frames = FramesOf(images, *dataset);
  if (std::none_of(frames.begin(), frames.end(), [](const auto& frame) { return frame; })) {
    throw Error("{}: is none of the {} images of the map: expected the images that made it",
                dataset->Name(0), frames.size());
  }
  return std::make_unique<DatasetPhotographs>(std::move(dataset), std::move(frames), images.names);
}

}  // namespace deepuav
