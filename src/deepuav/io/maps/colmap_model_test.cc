#include "deepuav/io/maps/colmap_model.h"

#include <gmock/gmock.h>

#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Camera CameraWith(LensModel lens, std::vector<double> distortion) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.pinhole = {500.5, 501.25, 318.75, 243.5};
  camera.lens = lens;
  camera.distortion = std::move(distortion);
  return camera;
}

struct ColmapImage {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation;
  int camera = 0;
  std::string name;
  std::vector<std::pair<Eigen::Vector2d, int64_t>> points;
};

struct ColmapPoint {
  Eigen::Vector3d position;
  double error = 0;
  std::vector<std::pair<int, int>> track;
};

/// A text model as COLMAP's documentation of its format states it.
struct ColmapModel {
  std::string camera_model;
  int width = 0, height = 0;
  std::vector<double> parameters;
  std::map<int, ColmapImage> images;
  std::map<int64_t, ColmapPoint> points;
};

std::vector<std::string> DataLines(const std::filesystem::path& file) {
  std::istringstream stream(ReadAll(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with('#')) lines.push_back(line);
  }
  return lines;
}

ColmapModel ReadModel(const std::filesystem::path& folder) {
  ColmapModel model;
  const std::vector<std::string> cameras = DataLines(folder / "cameras.txt");
  EXPECT_EQ(cameras.size(), 1u);
  std::istringstream camera(cameras.at(0));
  int id = 0;
  camera >> id >> model.camera_model >> model.width >> model.height;
  EXPECT_EQ(id, 1);
  for (double value; camera >> value;) model.parameters.push_back(value);

  const std::vector<std::string> images = DataLines(folder / "images.txt");
  EXPECT_EQ(images.size() % 2, 0u);
  for (size_t i = 0; i + 1 < images.size(); i += 2) {
    ColmapImage image;
    std::istringstream pose(images[i]), points(images[i + 1]);
    Eigen::Vector3d& t = image.translation;
    double w, x, y, z;
    pose >> id >> w >> x >> y >> z >> t.x() >> t.y() >> t.z() >> image.camera >> image.name;
    EXPECT_TRUE(pose && pose.peek() == EOF) << images[i];
    image.rotation = {w, x, y, z};
    int64_t point = 0;
    for (double u, v; points >> u >> v >> point;) image.points.push_back({{u, v}, point});
    EXPECT_TRUE(model.images.emplace(id, image).second);
  }

  for (const std::string& line : DataLines(folder / "points3D.txt")) {
    std::istringstream stream(line);
    ColmapPoint point;
    int64_t point_id = 0;
    int red, green, blue, image, index;
    Eigen::Vector3d& p = point.position;
    stream >> point_id >> p.x() >> p.y() >> p.z() >> red >> green >> blue >> point.error;
    while (stream >> image >> index) point.track.push_back({image, index});
    EXPECT_TRUE(model.points.emplace(point_id, point).second);
  }
  return model;
}

/// COLMAP's camera models, from its documentation.
Eigen::Vector2d ColmapPixel(const ColmapModel& model, const Eigen::Vector3d& point_cam) {
  const std::vector<double>& p = model.parameters;
  double u = point_cam.x() / point_cam.z(), v = point_cam.y() / point_cam.z();
  const double r2 = u * u + v * v;
  if (model.camera_model == "OPENCV_FISHEYE") {
    const double r = std::sqrt(r2), theta = std::atan(r), t2 = theta * theta;
    const double distorted =
        theta * (1 + p[4] * t2 + p[5] * t2 * t2 + p[6] * std::pow(t2, 3) + p[7] * std::pow(t2, 4));
    u *= distorted / r;
    v *= distorted / r;
  } else if (model.camera_model != "PINHOLE") {
    const bool full = model.camera_model == "FULL_OPENCV";
    double radial = 1 + p[4] * r2 + p[5] * r2 * r2;
    if (full) {
      radial += p[8] * std::pow(r2, 3);
      radial /= 1 + p[9] * r2 + p[10] * r2 * r2 + p[11] * std::pow(r2, 3);
    }
    const double du = 2 * p[6] * u * v + p[7] * (r2 + 2 * u * u);
    const double dv = 2 * p[7] * u * v + p[6] * (r2 + 2 * v * v);
    u = u * radial + du;
    v = v * radial + dv;
  }
  return {p[0] * u + p[2], p[1] * v + p[3]};
}

SE3 CamFromWorld(int keyframe) {
  return SE3(RotationExp({0.02 * keyframe, -0.05 * keyframe, 0.3}), {0.3 * keyframe, -0.1, 0.2});
}

/// Three keyframes that see the landmarks where the camera projects them, all moved by `error_px`.
/// Key point 0 of each shows none; ids do not begin with 0.
Map ProjectedMap(const Camera& camera, const Eigen::Vector2d& error_px) {
  constexpr int kLandmarks = 40;
  Random random(5);
  std::vector<Eigen::Vector3d> positions;
  for (int i = 0; i < kLandmarks; ++i) {
    positions.push_back({random.Uniform(-2, 2), random.Uniform(-1.5, 1.5), random.Uniform(5, 9)});
  }
  Map map(MapId{0});
  for (int k = 0; k < 3; ++k) {
    Features features{{}, Descriptors(2)};
    const auto add = [&](const Eigen::Vector2d& px) {
      features.keypoints.push_back({px.cast<float>(), px.cast<float>(), 0.5f, 1.0f});
      features.descriptors.Append(std::vector<float>{1, 0});
    };
    add({7, 9});
    for (const Eigen::Vector3d& position : positions)
      add(camera.Distort(CamFromWorld(k) * position).value() + error_px);
    const Frame frame{FrameId{k}, {1000 + k}, std::make_shared<const Features>(features)};
    map.AddKeyframe(KeyframeId{4 + 2 * k}, frame, CamFromWorld(k));
    if (k > 0) map.ConnectToParent(KeyframeId{4 + 2 * k}, KeyframeId{4});
  }
  for (int i = 0; i < kLandmarks; ++i) {
    const LandmarkId id{10 + i};
    map.AddLandmark(id, positions[static_cast<size_t>(i)], KeyframeId{4});
    for (int k = i % 2; k < 3; ++k) map.AddObservation(KeyframeId{4 + 2 * k}, i + 1, id);
  }
  return map;
}

class ColmapModelTest : public ::testing::Test {
 protected:
  ColmapModel Written(const Map& map, const Camera& camera,
                      const std::map<KeyframeId, std::string>& names = {}) {
    WriteColmapModel(folder_.path() / "model", map, camera, names);
    return ReadModel(folder_.path() / "model");
  }
  void ExpectPixelsOfColmap(const Camera& camera, const std::string& model);

  TemporaryFolder folder_;
};

/// What COLMAP projects with the model lies where the key points are, for every lens.
void ColmapModelTest::ExpectPixelsOfColmap(const Camera& camera, const std::string& expected) {
  const ColmapModel model = Written(ProjectedMap(camera, {0, 0}), camera);
  EXPECT_EQ(model.camera_model, expected);
  EXPECT_EQ(model.width, camera.width);
  EXPECT_EQ(model.height, camera.height);
  ASSERT_EQ(model.images.size(), 3u);
  ASSERT_EQ(model.points.size(), 40u);
  int checked = 0;
  for (const auto& [id, point] : model.points) {
    EXPECT_LT(point.error, 1e-4);
    for (const auto& [image_id, index] : point.track) {
      const ColmapImage& image = model.images.at(image_id);
      const auto& [px, seen] = image.points.at(static_cast<size_t>(index));
      EXPECT_EQ(seen, id);
      const Eigen::Vector3d point_cam = image.rotation * point.position + image.translation;
      EXPECT_LT((ColmapPixel(model, point_cam) - px).norm(), 1e-4);  // key points are floats
      ++checked;
    }
  }
  EXPECT_EQ(checked, 20 * 3 + 20 * 2);
}

TEST_F(ColmapModelTest, Pinhole) {
  ExpectPixelsOfColmap(CameraWith(LensModel::kPinhole, {}), "PINHOLE");
}

TEST_F(ColmapModelTest, RadialTangential) {
  ExpectPixelsOfColmap(CameraWith(LensModel::kRadialTangential, {-0.28, 0.07, 0.003, -0.002}),
                       "OPENCV");
}

TEST_F(ColmapModelTest, RadialTangentialOfThreeRadii) {
  ExpectPixelsOfColmap(CameraWith(LensModel::kRadialTangential, {-0.28, 0.07, 0.003, -0.002, 0.01}),
                       "FULL_OPENCV");
}

TEST_F(ColmapModelTest, Equidistant) {
  ExpectPixelsOfColmap(CameraWith(LensModel::kEquidistant, {0.02, -0.01, 0.004, -0.001}),
                       "OPENCV_FISHEYE");
}

/// COLMAP's first pixel has its centre at (0.5, 0.5), ours at (0, 0).
TEST_F(ColmapModelTest, PixelsMoveByHalfOfOne) {
  const Camera camera = CameraWith(LensModel::kPinhole, {});
  const ColmapModel model = Written(ProjectedMap(camera, {0, 0}), camera);
  EXPECT_THAT(model.parameters, ElementsAre(500.5, 501.25, 319.25, 244));
  EXPECT_EQ(model.images.at(5).points.front().first, Eigen::Vector2d(7.5, 9.5));
  EXPECT_EQ(model.images.at(5).points.front().second, -1);
}

TEST_F(ColmapModelTest, PosesAndIdsAreKept) {
  const Camera camera = CameraWith(LensModel::kPinhole, {});
  const ColmapModel model = Written(ProjectedMap(camera, {0, 0}), camera);
  for (int k = 0; k < 3; ++k) {
    const ColmapImage& image = model.images.at(5 + 2 * k);
    EXPECT_EQ(image.rotation.coeffs(), CamFromWorld(k).rotation().coeffs());
    EXPECT_EQ(image.translation, CamFromWorld(k).translation());
    EXPECT_EQ(image.camera, 1);
    EXPECT_EQ(image.points.size(), 41u);
  }
  EXPECT_TRUE(model.points.contains(11));
  EXPECT_TRUE(model.points.contains(50));
}

TEST_F(ColmapModelTest, ErrorsAreReprojectionErrors) {
  const Camera camera = CameraWith(LensModel::kRadialTangential, {-0.28, 0.07, 0.003, -0.002});
  for (const auto& [id, point] : Written(ProjectedMap(camera, {3, -4}), camera).points)
    EXPECT_NEAR(point.error, 5, 1e-4);
}

TEST_F(ColmapModelTest, NamesWithoutBlanksOrElseTimes) {
  const Camera camera = CameraWith(LensModel::kPinhole, {});
  const ColmapModel model = Written(ProjectedMap(camera, {0, 0}), camera,
                                    {{KeyframeId{4}, "a photo\n1.jpg"}, {KeyframeId{6}, ""}});
  EXPECT_EQ(model.images.at(5).name, "a_photo_1.jpg");
  EXPECT_EQ(model.images.at(7).name, "1001");
  EXPECT_EQ(model.images.at(9).name, "1002");
}

TEST_F(ColmapModelTest, NamesDifferWhereThoseOfTheFilesDoNot) {
  const Camera camera = CameraWith(LensModel::kPinhole, {});
  const ColmapModel model = Written(ProjectedMap(camera, {0, 0}), camera,
                                    {{KeyframeId{4}, "000010.png"}, {KeyframeId{6}, "000010.png"}});
  EXPECT_EQ(model.images.at(5).name, "000010.png");
  EXPECT_EQ(model.images.at(7).name, "7_000010.png");
}

/// A landmark behind all its cameras, as damage could leave one.
TEST_F(ColmapModelTest, APointThatProjectsNowhereHasNoError) {
  const Camera camera = CameraWith(LensModel::kPinhole, {});
  Map map = ProjectedMap(camera, {0, 0});
  map.SetPosition(LandmarkId{10}, {0, 0, -50});
  EXPECT_EQ(Written(map, camera).points.at(11).error, -1);
}

TEST_F(ColmapModelTest, ErrorsNameTheFile) {
  const Camera camera = CameraWith(LensModel::kPinhole, {});
  const auto file = folder_.Write("file", "");
  EXPECT_THAT(ErrorOf([&] { WriteColmapModel(file, Map(MapId{0}), camera, {}); }),
              HasSubstr("file"));
}

}  // namespace
}  // namespace deepuav
