#include "deepuav/evaluation/drawing/survey_pictures.h"

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"
#include "deepuav/evaluation/drawing/packed_array.h"
#include "deepuav/ortho/orthophoto.h"

namespace deepuav {
namespace {

using Json = nlohmann::json;

// Blue, green, red: from one photograph, which tells no height, to eight and more.
constexpr std::array<std::array<int, 3>, 8> kOverlapColours = {{{38, 26, 165},
                                                                {67, 109, 244},
                                                                {97, 174, 253},
                                                                {139, 224, 254},
                                                                {139, 239, 217},
                                                                {99, 189, 102},
                                                                {80, 152, 26},
                                                                {160, 110, 30}}};

std::string DataUri(const char* ending, const char* type, const cv::Mat& picture,
                    const std::vector<int>& parameters = {}) {
  std::vector<uint8_t> bytes;
  cv::imencode(ending, picture, bytes, parameters);
  return fmt::format("data:image/{};base64,{}", type,
                     Base64({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
}

Json OverlapColours() {
  Json colours = Json::array();
  for (const auto& [blue, green, red] : kOverlapColours)
    colours.push_back(fmt::format("rgb({},{},{})", red, green, blue));
  return colours;
}

cv::Mat4b OverlapPicture(const cv::Mat1w& count) {
  cv::Mat4b picture = cv::Mat4b::zeros(count.size());
  for (int row = 0; row < count.rows; ++row) {
    for (int column = 0; column < count.cols; ++column) {
      if (count(row, column) == 0) continue;
      const auto index = std::min<size_t>(count(row, column), kOverlapColours.size()) - 1;
      const auto& [blue, green, red] = kOverlapColours[index];
      picture(row, column) = {static_cast<uchar>(blue), static_cast<uchar>(green),
                              static_cast<uchar>(red), 255};
    }
  }
  return picture;
}

Json CameraPlaces(const MapScene& scene, const GeoRaster& raster) {
  Json places = Json::array();
  for (const OrthoView& view : scene.scene.views) {
    const Eigen::Vector3d place =
        scene.scene.frame.ground_from_world(view.cam_from_world.InverseTranslation());
    places.push_back({(place.x() - raster.west) / (raster.columns * raster.cell),
                      (raster.north - place.y()) / (raster.rows * raster.cell)});
  }
  return places;
}

/// Medians of the reprojection errors in cells over the image; NaN where fewer than three are.
struct ErrorGrid {
  cv::Mat1f median_px;
  double all_px = 0;
};

ErrorGrid ErrorsOverImage(const Map& map, const Camera& camera, int columns) {
  const int rows = std::max(1, columns * camera.height / camera.width);
  std::vector<std::vector<float>> errors(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  std::vector<float> all;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    for (const Observation& observation : landmark.observations) {
      const Keyframe& keyframe = map.At(observation.keyframe);
      const Eigen::Vector3d point = keyframe.cam_from_world * landmark.position_world;
      if (!(point.z() > 0)) continue;
      const Eigen::Vector2f px =
          keyframe.features().keypoints[static_cast<size_t>(observation.keypoint)].image_px;
      const int column = static_cast<int>(px.x()) * columns / camera.width;
      const int row = static_cast<int>(px.y()) * rows / camera.height;
      if (column < 0 || column >= columns || row < 0 || row >= rows) continue;
      const Eigen::Vector2f seen = camera.pinhole.Project(point).cast<float>();
      all.push_back((seen - observation.measured.px).norm());
      errors[static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column)]
          .push_back(all.back());
    }
  });
  constexpr size_t kFewest = 3;
  ErrorGrid grid{cv::Mat1f(rows, columns, std::nanf("")), 0};
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      std::vector<float>& cell = errors[static_cast<size_t>(row) * static_cast<size_t>(columns) +
                                        static_cast<size_t>(column)];
      if (cell.size() >= kFewest) grid.median_px(row, column) = Median(cell);
    }
  }
  if (!all.empty()) grid.all_px = static_cast<double>(Median(all));
  return grid;
}

Json ErrorsJson(const Map& map, const Camera& camera, int columns) {
  constexpr int kZoom = 12;
  const ErrorGrid grid = ErrorsOverImage(map, camera, columns);
  const cv::Mat known = grid.median_px == grid.median_px;
  double most = 0;
  cv::minMaxLoc(grid.median_px, nullptr, &most, nullptr, nullptr, known);
  cv::Mat1b level;
  grid.median_px.convertTo(level, CV_8U, most > 0 ? 255 / most : 0);
  cv::Mat colours;
  cv::applyColorMap(level, colours, cv::COLORMAP_VIRIDIS);
  cv::cvtColor(colours, colours, cv::COLOR_BGR2BGRA);
  colours.setTo(cv::Scalar::all(0), ~known);
  cv::resize(colours, colours, {}, kZoom, kZoom, cv::INTER_NEAREST);
  return {{"picture", DataUri(".png", "png", colours)},
          {"aspect", static_cast<double>(camera.width) / camera.height},
          {"most_px", most},
          {"median_px", grid.all_px}};
}

}  // namespace

void SurveyPictureOptions::Check() const { CheckOptions("", *this); }

Json SurveyPictures(const LoadedAtlas& loaded, MapId map, std::unique_ptr<Dataset> dataset,
                    const SurveyPictureOptions& options) {
  options.Check();
  const MapScene scene = SceneOf(loaded, map);
  const OrthoOptions ortho;
  OrthoPlan plan = PlanOrtho(scene, {}, ortho);
  Json json = {{"about", scene.scene.frame.about},
               {"aspect", static_cast<double>(plan.raster.columns) / plan.raster.rows},
               {"overlap", DataUri(".png", "png", OverlapPicture(plan.choice.count))},
               {"overlap_colors", OverlapColours()},
               {"cameras", CameraPlaces(scene, plan.raster)},
               {"errors", ErrorsJson(loaded.atlas.At(map), loaded.camera, options.error_columns)}};
  if (!dataset) return json;
  const auto photographs = PhotographsOf(scene.images, std::move(dataset));
  plan.cells_a_step = std::max(1, options.width_px / plan.raster.columns);
  cv::Mat4b picture = cv::Mat4b::zeros(MosaicSize(plan.surface.grid, plan.cells_a_step));
  MakeOrthophoto(
      scene, &plan, photographs.get(), ortho,
      [&](const cv::Rect& window, const cv::Mat& pixels) { pixels.copyTo(picture(window)); },
      [](double /*share*/) {});
  if (picture.cols > options.width_px) {
    const double ratio = static_cast<double>(options.width_px) / picture.cols;
    cv::resize(picture, picture, {}, ratio, ratio, cv::INTER_AREA);
  }
  json["orthophoto"] =
      DataUri(".webp", "webp", picture, {cv::IMWRITE_WEBP_QUALITY, options.quality});
  return json;
}

}  // namespace deepuav
