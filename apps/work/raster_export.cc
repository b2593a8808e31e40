#include "work/raster_export.h"

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "arguments/argument_checks.h"
#include "arguments/option_bounds_check.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/geotiff_file.h"
#include "deepuav/ortho/orthophoto.h"
#include "work/progress_bar.h"

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

std::unique_ptr<Dataset> OpenImages(const fs::path& map_file, const RasterArguments& arguments) {
  const ImageSourceOfRun source =
      arguments.images.empty() ? ImagesOfRun(map_file) : ImageSourceOfRun{arguments.images, {}};
  DatasetOptions options;
  if (fs::exists(source.camera)) options.camera_file = source.camera;
  return OpenDataset(source.dataset, options);
}

void Describe(const OrthoPlan& plan, const GroundFrame& frame) {
  std::cout << fmt::format(
      "{} x {} cells of {:.4g}; {}; a surface through {} landmarks, {} left out\n",
      plan.raster.columns, plan.raster.rows, plan.raster.cell, frame.about, plan.surface.landmarks,
      plan.surface.outliers);
}

OrthoOptions OptionsOf(const RasterArguments& arguments) {
  OrthoOptions options;
  options.resolution = arguments.resolution;
  return options;
}

}  // namespace

void AddRasterArguments(CLI::App& command, RasterArguments& arguments) {
  command
      .add_option("--resolution", arguments.resolution,
                  "Width of a cell of an orthophoto or DSM, in the map's unit; by default what a "
                  "photograph's pixel shows, or what the landmarks tell")
      ->check(NumberThat([](double value) { return value > 0; }, "a positive number"))
      ->check(WithinBoundsOf<OrthoOptions>("resolution"));
  command
      .add_option("--images", arguments.images,
                  "The folder or video that the map was made of, where it is not where it was")
      ->check(NamedPath());
}

void ExportOrthophoto(const fs::path& out, const LoadedAtlas& loaded, MapId map,
                      const fs::path& map_file, const RasterArguments& arguments) {
  LogToStderr("warn");
  const MapScene scene = SceneOf(loaded, map);
  const auto photographs = PhotographsOf(scene, OpenImages(map_file, arguments));
  const OrthoOptions options = OptionsOf(arguments);
  OrthoPlan plan = PlanOrtho(scene, photographs->stored_size().width, options);
  Describe(plan, scene.scene.frame);
  GeoTiffWriter writer(out, plan.raster, GeoTiffPixels::kColour);
  constexpr int kParts = 100;
  ProgressBar bar(kParts, "percent");
  MakeOrthophoto(
      scene, &plan, photographs.get(), options,
      [&](const cv::Rect& window, const cv::Mat& pixels) { writer.Write(window, pixels); },
      [&](double share) { bar.Advance(static_cast<int>(kParts * share), "mosaic"); });
  writer.Commit();
}

void ExportDsm(const fs::path& out, const LoadedAtlas& loaded, MapId map,
               const RasterArguments& arguments) {
  const MapScene scene = SceneOf(loaded, map);
  const OrthoPlan plan = PlanOrtho(scene, {}, OptionsOf(arguments));
  Describe(plan, scene.scene.frame);
  GeoTiffWriter writer(out, plan.raster, GeoTiffPixels::kHeight);
  MakeDsm(plan,
          [&](const cv::Rect& window, const cv::Mat& heights) { writer.Write(window, heights); });
  writer.Commit();
}

}  // namespace deepuav
