#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/ortho/map_scene.h"

namespace deepuav {

/// A ground of known heights and colours, seen straight down by cameras in lines, `kHeight` above
/// its zero.
class SyntheticGround {
 public:
  static constexpr double kHeight = 50, kSpacing = 12;
  static constexpr int kColumns = 5, kRows = 4;

  std::function<double(double x, double y)> height = [](double x, double y) {
    return 2.5 * std::sin(x / 9) * std::cos(y / 11);
  };

  double top = 3;  ///< No height is above.

  static cv::Vec3b ColourAt(double x, double y) {
    const double wide = std::sin(x / 3.1) * std::sin(y / 2.7);
    const double fine = std::sin(x * 1.9 + std::sin(y * 1.3)) * std::cos(y * 2.3 + x / 2);
    const auto level = [](double value) { return cv::saturate_cast<uchar>(value); };
    return {level(110 + 30 * wide + 25 * fine), level(120 + 20 * wide + 35 * fine),
            level(100 + 40 * wide + 20 * fine)};
  }

  static Camera TestCamera() {
    Camera camera;
    camera.width = 320;
    camera.height = 240;
    camera.pinhole = {300, 300, 161, 118};
    camera.lens = LensModel::kRadialTangential;
    camera.distortion = {-0.2, 0.05, 0, 0};
    return camera;
  }

  static GroundFrame Level() {
    const auto same = [](const Eigen::Vector3d& point) { return point; };
    return {same, same, {}, "level"};
  }

  MapScene Scene(int landmarks, double outlier_share) const {
    MapScene scene;
    scene.scene.camera = TestCamera();
    scene.scene.frame = Level();
    const Eigen::Quaterniond down(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const SE3 world_from_cam(down, Eigen::Vector3d(column * kSpacing, row * kSpacing, kHeight));
        scene.scene.views.push_back({world_from_cam.Inverse(), {}});
        scene.images.names.emplace_back("view");
        scene.images.times.push_back({});
      }
    }
    Random random(7);
    for (int i = 0; i < landmarks; ++i) {
      const double x = random.Uniform(-15, kColumns * kSpacing + 3);
      const double y = random.Uniform(-12, kRows * kSpacing);
      const bool is_wrong = random.Uniform(0, 1) < outlier_share;
      const double off = is_wrong ? random.Uniform(-20, 20) : random.Gaussian(0.03);
      scene.landmarks.emplace_back(x, y, height(x, y) + off);
    }
    return scene;
  }

  /// Where the ray meets the ground.
  Eigen::Vector2d Meet(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) const {
    // Along the ray from above, so that what stands in front hides what lies behind.
    constexpr double kStep = 0.3;
    constexpr int kHalvings = 7;
    const auto is_above = [&](double depth) {
      const Eigen::Vector3d at = from + depth * ray;
      return at.z() > height(at.x(), at.y());
    };
    double low = (from.z() - top) / -ray.z();
    while (is_above(low + kStep)) low += kStep;
    double high = low + kStep;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (low + high) / 2;
      (is_above(middle) ? low : high) = middle;
    }
    return (from + high * ray).head<2>();
  }

  cv::Mat3b Render(const MapScene& scene, size_t view) const {
    const Camera& camera = scene.scene.camera;
    const SE3 world_from_cam = scene.scene.views[view].cam_from_world.Inverse();
    cv::Mat3b image(camera.height, camera.width);
    cv::parallel_for_({0, image.rows}, [&](const cv::Range& rows) {
      for (int y = rows.start; y < rows.end; ++y) {
        for (int x = 0; x < image.cols; ++x) {
          const auto px = camera.Undistort(Eigen::Vector2d(x, y));
          const Eigen::Vector3d ray = world_from_cam.rotation() * camera.pinhole.Unproject(*px);
          const Eigen::Vector2d place = Meet(world_from_cam.translation(), ray);
          image(y, x) = ColourAt(place.x(), place.y());
        }
      }
    });
    return image;
  }
};

/// Pictures in memory, each as bright as `gains` says.
class PicturesInMemory : public Photographs {
 public:
  PicturesInMemory(const SyntheticGround& ground, const MapScene& scene,
                   const std::vector<double>& gains = {}) {
    for (size_t view = 0; view < scene.scene.views.size(); ++view) {
      pictures_.push_back(ground.Render(scene, view));
      if (!gains.empty()) pictures_.back() *= gains[view % gains.size()];
    }
  }

  cv::Size stored_size() const override { return pictures_.front().size(); }
  cv::Mat3b Load(int view, const cv::Size& size) override {
    if (view == broken) throw Error("view.jpg: is broken");
    cv::Mat3b picture;
    cv::resize(pictures_[static_cast<size_t>(view)], picture, size, 0, 0, cv::INTER_AREA);
    return picture;
  }

  int broken = -1;

 private:
  std::vector<cv::Mat3b> pictures_;
};

}  // namespace deepuav
