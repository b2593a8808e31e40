#include "deepuav/geometry/camera.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kTolerancePx = 1e-6;

Camera EurocCamera() {
  return {752,
          480,
          {458.654, 457.296, 367.215, 248.375},
          LensModel::kRadialTangential,
          {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05},
          20};
}

Camera FiveCoefficientCamera() {
  return {640,
          480,
          {517.306408, 516.469215, 318.643040, 255.313989},
          LensModel::kRadialTangential,
          {0.262383, -0.953104, -0.005358, 0.002628, 1.163314},
          30};
}

Camera FisheyeCamera() {
  return {800,
          640,
          {290, 291, 399.5, 319.5},
          LensModel::kEquidistant,
          {0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673},
          20};
}

Camera PinholeCamera() { return {640, 480, {500, 510, 320, 240}, LensModel::kPinhole, {}, 0}; }

// Every pixel of a grid is undistorted, and the ray found distorts back to the pixel.
void ExpectImageRoundTrip(const Camera& camera, double step_px) {
  for (double v = 0; v <= camera.height - 1; v += step_px) {
    for (double u = 0; u <= camera.width - 1; u += step_px) {
      const Eigen::Vector2d pixel(u, v);
      const auto undistorted = camera.Undistort(pixel);
      ASSERT_TRUE(undistorted) << pixel.transpose();
      const auto back = camera.Distort(camera.pinhole.Unproject(*undistorted));
      ASSERT_TRUE(back) << pixel.transpose();
      ASSERT_LT((*back - pixel).norm(), kTolerancePx) << pixel.transpose();
    }
  }
}

// Rays at every angle up to `max_angle` are found again from the pixel at which they appear.
void ExpectRayRoundTrip(const Camera& camera, double max_angle) {
  for (double angle = 0; angle < max_angle; angle += 0.01) {
    for (double direction = 0; direction < 2 * M_PI; direction += 0.1) {
      const Eigen::Vector3d ray(std::tan(angle) * std::cos(direction),
                                std::tan(angle) * std::sin(direction), 1);
      const auto pixel = camera.Distort(2.5 * ray);
      ASSERT_TRUE(pixel) << angle;
      const auto undistorted = camera.Undistort(*pixel);
      ASSERT_TRUE(undistorted) << angle << " " << direction;
      ASSERT_LT((*undistorted - camera.pinhole.Project(ray)).norm(), kTolerancePx) << angle;
    }
  }
}

TEST(Pinhole, ProjectsAndUnprojects) {
  const Pinhole pinhole{500, 510, 320, 240};
  const Eigen::Vector3d point(0.4, -0.6, 2);
  EXPECT_TRUE(pinhole.Project(point).isApprox(Eigen::Vector2d(420, 87)));
  EXPECT_TRUE(pinhole.Unproject({420, 87}).isApprox(point / 2));
  EXPECT_TRUE((pinhole.Matrix() * point / 2).isApprox(Eigen::Vector3d(420, 87, 1)));
}

TEST(Pinhole, JacobianIsThatOfProject) {
  const Pinhole pinhole{500, 510, 320, 240};
  const Eigen::Vector3d point(0.4, -0.6, 2);
  const double step = 1e-6;
  Eigen::Matrix<double, 2, 3> numeric;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(i);
    numeric.col(i) =
        (pinhole.Project(point + offset) - pinhole.Project(point - offset)) / (2 * step);
  }
  EXPECT_LT((pinhole.ProjectJacobian(point) - numeric).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(CameraDistort, AgreesWithOpenCv) {
  const std::vector<Eigen::Vector3d> points{{0.3, -0.2, 1}, {-0.75, 0.45, 1}, {0.05, 0.6, 1.2}};
  // From cv::projectPoints and cv::fisheye::projectPoints.
  Camera camera = EurocCamera();
  const auto expect = [&](const std::vector<Eigen::Vector2d>& pixels) {
    for (size_t i = 0; i < points.size(); ++i) {
      EXPECT_LT((camera.Distort(points[i]).value() - pixels[i]).norm(), 1e-8) << i;
    }
  };
  expect({{499.905568539, 160.188744690},
          {82.870621144, 418.547910816},
          {385.057487476, 461.848852150}});
  camera.distortion = {0.2624, -0.9531, -0.0054, 0.0026, 1.1633};
  expect({{508.307113088, 154.374114068},
          {-29.183181251, 484.166353642},
          {386.989474789, 480.752793619}});
  camera = FisheyeCamera();
  expect({{483.034636034, 263.618208998},
          {220.489242866, 427.276821364},
          {410.708062019, 454.460526105}});
}

TEST(CameraDistort, PinholeHasNoDistortion) {
  const Eigen::Vector3d point(0.3, -0.2, 1.5);
  EXPECT_EQ(PinholeCamera().Distort(point), PinholeCamera().pinhole.Project(point));
  EXPECT_TRUE(PinholeCamera().Undistort({11, 12})->isApprox(Eigen::Vector2d(11, 12)));
}

TEST(CameraDistort, RefusesPointsThatAreNotInFront) {
  for (const Camera& camera : {PinholeCamera(), EurocCamera(), FisheyeCamera()}) {
    EXPECT_FALSE(camera.Distort({0.1, 0.1, -1}));
    EXPECT_FALSE(camera.Distort({0.1, 0.1, 0}));
    EXPECT_FALSE(camera.Distort({0.1, kNaN, 1}));
    EXPECT_FALSE(camera.Undistort({kNaN, 10}));
  }
}

// r (1 - 0.3 r^2) has its maximum at r = sqrt(1 / 0.9).
TEST(CameraDistort, RefusesPointsBeyondTheFold) {
  Camera camera = EurocCamera();
  camera.distortion = {-0.3, 0, 0, 0};
  const double fold = std::sqrt(1 / 0.9);
  EXPECT_TRUE(camera.Distort({fold - 1e-9, 0, 1}));
  EXPECT_FALSE(camera.Distort({fold + 1e-9, 0, 1}));
  EXPECT_FALSE(camera.Distort({0, -5, 1}));

  const double edge_px = camera.pinhole.fx * fold * (1 - 0.3 * fold * fold);
  EXPECT_TRUE(camera.Undistort({camera.pinhole.cx + edge_px - 1e-3, camera.pinhole.cy}));
  EXPECT_FALSE(camera.Undistort({camera.pinhole.cx + edge_px + 1e-3, camera.pinhole.cy}));
}

// The slope 1 - 0.9 r^2 + 0.15 r^4 is negative between its two roots only; what lies beyond the
// second is outside, too.
TEST(CameraDistort, StaysWithinTheFirstFoldWhereTheLensUnfoldsAgain) {
  Camera camera = EurocCamera();
  camera.distortion = {-0.3, 0.03, 0, 0};
  const double fold = std::sqrt((0.9 - std::sqrt(0.81 - 0.6)) / 0.3);
  EXPECT_TRUE(camera.Distort({fold - 1e-9, 0, 1}));
  EXPECT_FALSE(camera.Distort({fold + 1e-9, 0, 1}));
  EXPECT_FALSE(camera.Distort({3, 0, 1}));
  ExpectRayRoundTrip(camera, std::atan(0.99 * fold));
}

TEST(CameraDistort, FisheyeRefusesAnglesBeyondTheFold) {
  Camera camera = FisheyeCamera();
  camera.distortion = {-0.3, 0, 0, 0};
  const double fold = std::sqrt(1 / 0.9);
  EXPECT_TRUE(camera.Distort({std::tan(fold - 1e-9), 0, 1}));
  EXPECT_FALSE(camera.Distort({std::tan(fold + 1e-9), 0, 1}));
}

TEST(CameraUndistort, InvertsTheEurocLens) {
  ExpectImageRoundTrip(EurocCamera(), 7);
  ExpectRayRoundTrip(EurocCamera(), Camera::kMaxAngleRad - 1e-3);
}

TEST(CameraUndistort, InvertsAFiveCoefficientLens) {
  ExpectImageRoundTrip(FiveCoefficientCamera(), 7);
  ExpectRayRoundTrip(FiveCoefficientCamera(), 0.6);
}

TEST(CameraUndistort, InvertsAFisheyeOf150Degrees) {
  ExpectRayRoundTrip(FisheyeCamera(), Camera::kMaxAngleRad - 1e-3);
  Camera inner = FisheyeCamera();
  inner.width = 600;
  inner.height = 440;
  inner.pinhole.cx = 299.5;
  inner.pinhole.cy = 219.5;
  ExpectImageRoundTrip(inner, 7);
}

TEST(CameraUndistort, RefusesRaysBeyondTheGreatestAngle) {
  const Camera fisheye = FisheyeCamera();
  const double beyond = std::tan(Camera::kMaxAngleRad + 1e-4);
  const auto pixel = fisheye.Distort({beyond, 0, 1});
  ASSERT_TRUE(pixel);
  EXPECT_FALSE(fisheye.Undistort(*pixel));
  EXPECT_FALSE(fisheye.Undistort({0, 0}));
  EXPECT_FALSE(EurocCamera().Undistort(*EurocCamera().Distort({0, beyond, 1})));
  EXPECT_FALSE(PinholeCamera().Undistort({320 + 500 * beyond, 240}));
}

// Lenses drawn at random: whatever is within the one-to-one range of Distort comes back, with
// tangential parts a hundred times those of real lenses.
TEST(CameraUndistort, InvertsRandomLenses) {
  Random random(5);
  int tried = 0;
  for (int i = 0; i < 20000; ++i) {
    Camera camera = EurocCamera();
    camera.distortion = {random.Uniform(-0.4, 0.4), random.Uniform(-0.2, 0.2),
                         random.Uniform(-0.01, 0.01), random.Uniform(-0.01, 0.01),
                         random.Uniform(-0.1, 0.1)};
    const Eigen::Vector3d ray(random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), 1);
    const auto slightly_further = camera.Distort({1.1 * ray.x(), 1.1 * ray.y(), 1});
    if (!slightly_further) continue;
    ++tried;
    const auto undistorted = camera.Undistort(*camera.Distort(ray));
    ASSERT_TRUE(undistorted) << i << ": " << ray.transpose();
    ASSERT_LT((*undistorted - camera.pinhole.Project(ray)).norm(), kTolerancePx) << i;
  }
  EXPECT_GT(tried, 10000);
}

void ExpectRefused(const Camera& camera, const std::string& field) {
  EXPECT_THAT(
      [&] { camera.Check("sensor.yaml"); },
      ThrowsMessage<Error>(AllOf(HasSubstr("sensor.yaml: " + field), HasSubstr("expected"))));
}

TEST(CameraCheck, AcceptsGoodCameras) {
  for (const Camera& camera :
       {PinholeCamera(), EurocCamera(), FiveCoefficientCamera(), FisheyeCamera()}) {
    EXPECT_NO_THROW(camera.Check("sensor.yaml"));
  }
}

TEST(CameraCheck, NamesTheBadField) {
  const auto changed = [](auto change) {
    Camera camera = EurocCamera();
    change(camera);
    return camera;
  };
  ExpectRefused(changed([](Camera& c) { c.width = 0; }), "width");
  ExpectRefused(changed([](Camera& c) { c.height = -480; }), "height");
  ExpectRefused(changed([](Camera& c) { c.pinhole.fx = 0; }), "fx");
  ExpectRefused(changed([](Camera& c) { c.pinhole.fy = kNaN; }), "fy");
  ExpectRefused(changed([](Camera& c) { c.pinhole.fx /= 10; }), "fy");
  ExpectRefused(changed([](Camera& c) { c.pinhole.cx = 752; }), "cx");
  ExpectRefused(changed([](Camera& c) { c.pinhole.cy = kNaN; }), "cy");
  ExpectRefused(changed([](Camera& c) { c.rate_hz = -1; }), "rate_hz");
  ExpectRefused(changed([](Camera& c) { c.distortion.pop_back(); }), "distortion");
  ExpectRefused(changed([](Camera& c) { c.distortion[1] = kNaN; }), "distortion");
  ExpectRefused(changed([](Camera& c) { c.lens = LensModel::kPinhole; }), "distortion");
  ExpectRefused(changed([](Camera& c) { c.distortion.clear(); }), "distortion");
  ExpectRefused(changed([](Camera& c) {
                  c.lens = LensModel::kEquidistant;
                  c.distortion.push_back(0);
                }),
                "distortion");
}

TEST(LargestDifferencePx, IsThatOfTheFarthestCorner) {
  const Camera camera = EurocCamera();
  EXPECT_LT(LargestDifferencePx(camera, camera), 1e-3);
  Camera shifted = camera;
  shifted.pinhole.cx += 3;
  shifted.pinhole.cy -= 4;
  EXPECT_NEAR(LargestDifferencePx(camera, shifted), 5, 1e-3);
  Camera plain = camera;
  plain.lens = LensModel::kPinhole;
  plain.distortion.clear();
  Camera longer = plain;
  longer.pinhole.fx *= 1.01;
  longer.pinhole.fy *= 1.01;
  const Eigen::Vector2d farthest(std::max(plain.pinhole.cx, plain.width - 1 - plain.pinhole.cx),
                                 std::max(plain.pinhole.cy, plain.height - 1 - plain.pinhole.cy));
  EXPECT_NEAR(LargestDifferencePx(plain, longer), 0.01 * farthest.norm(), 1e-6);
  EXPECT_GT(LargestDifferencePx(plain, camera), 20) << "the lens alone";
}

TEST(CameraCheck, RefusesALensThatNoGlassHas) {
  Camera camera = EurocCamera();
  for (const std::vector<double>& distortion : std::vector<std::vector<double>>{
           {1e10, 1e10, 0, 0}, {1e4, 0, 0, 0}, {0, 0, 1e10, 0}, {0, 0, 0, -1e10}}) {
    camera.distortion = distortion;
    ExpectRefused(camera, "distortion ");
  }
  camera = FisheyeCamera();
  camera.distortion = {1e6, 0, 0, 0};
  ExpectRefused(camera, "distortion moves the edge");
  for (const Camera& real : {EurocCamera(), FiveCoefficientCamera(), FisheyeCamera()})
    EXPECT_NO_THROW(real.Check("sensor.yaml"));
}

TEST(CameraCheck, RefusesALensThatFoldsInsideTheImage) {
  Camera camera = EurocCamera();
  camera.distortion = {-0.4, 0, 0, 0};  // folds at r = 0.913, seen 279 px from the centre
  ExpectRefused(camera, "distortion folds");
  camera.distortion = {-0.2, 0, 0, 0};  // folds at 395 px, inside the corners
  ExpectRefused(camera, "distortion folds");
  camera.distortion = {-0.1, 0, 0, 0};  // folds at 558 px, outside
  EXPECT_NO_THROW(camera.Check("sensor.yaml"));
}

}  // namespace
}  // namespace deepuav
