#include "work/raster_export.h"

#include <iostream>

#include "arguments/argument_checks.h"
#include "arguments/option_bounds_check.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/geodata/geotiff_file.h"
#include "deepuav/ortho/orthophoto.h"
#include "work/progress_bar.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

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
}

void ExportOrthophoto(const fs::path& out, const LoadedAtlas& loaded, MapId map,
                      const RunImages& images, const RasterArguments& arguments) {
  LogToStderr("warn");
  const MapScene scene = SceneOf(loaded, map);
  const auto photographs = PhotographsOf(scene.images, images.Open());
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
