#include "work/run_images.h"

#include <nlohmann/json.hpp>

#include "arguments/argument_checks.h"
#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

/// The dataset of a run, and the calibration that it was given.
struct ImageSourceOfRun {
  fs::path dataset, camera;
};

/// Out of the summary beside the map. Throws Error where there is none, or what it names is gone.
ImageSourceOfRun ImagesOfRun(const fs::path& map_file) {
  constexpr size_t kMaxBytes = size_t{64} << 20;
  const fs::path summary = map_file.parent_path() / "summary.json";
  ImageSourceOfRun source;
  if (fs::exists(summary)) {
    const auto json = nlohmann::json::parse(ReadBytes(summary, kMaxBytes), nullptr, false);
    const auto text = [&json](const char* pointer) {
      const nlohmann::json::json_pointer at(pointer);
      return json.is_object() && json.contains(at) && json.at(at).is_string()
                 ? json.at(at).get<std::string>()
                 : std::string();
    };
    source = {text("/dataset/path"), text("/dataset/camera_file")};
  }
  if (!source.dataset.empty() && fs::exists(source.dataset)) return source;
  throw Error("{}: {}: expected --images to name the folder or video that the map was made of",
              map_file.string(),
              source.dataset.empty() ? "no summary.json beside it names its images"
                                     : source.dataset.string() + " is no longer there");
}

}  // namespace

void AddImagesArgument(CLI::App& command, RunImages& images) {
  command
      .add_option("--images", images.named,
                  "The folder or video that the map was made of, where it is not where it was")
      ->check(NamedPath());
}

std::unique_ptr<Dataset> RunImages::Open() const {
  const ImageSourceOfRun source =
      named.empty() ? ImagesOfRun(map_file) : ImageSourceOfRun{named, {}};
  DatasetOptions options;
  if (fs::exists(source.camera)) options.camera_file = source.camera;
  return OpenDataset(source.dataset, options);
}

}  // namespace deepuav
