#include "deepuav/ortho/view_choice.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

/// A view with what is asked of it at every node.
struct PreparedView {
  Eigen::Vector3d centre_world, axis_world, centre_ground;
};

/// The largest angle from the optical axis at which the image still shows something.
double HalfFieldOfView(const Camera& camera) {
  double widest = 0;
  for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0), Eigen::Vector2d(camera.width - 1, 0),
                                        Eigen::Vector2d(0, camera.height - 1),
                                        Eigen::Vector2d(camera.width - 1, camera.height - 1)}) {
    const auto px = camera.Undistort(corner);
    const double angle =
        px ? std::atan(camera.pinhole.Unproject(*px).head<2>().norm()) : Camera::kMaxAngleRad;
    widest = std::max(widest, angle);
  }
  return widest;
}

class Chooser {
 public:
  Chooser(const OrthoScene& scene, const Surface& surface, double gsd,
          const ViewChoiceOptions& options)
      : scene_(scene), surface_(surface), options_(options), gsd_(gsd) {
    constexpr double kMore = 1.05;  // Rolling shutters see a little beyond.
    cos_field_ = std::cos(std::min(kMore * HalfFieldOfView(scene.camera), M_PI / 2));
    max_tan_ = std::tan(options.max_angle_deg * M_PI / 180);
    const double width = scene.camera.width, height = scene.camera.height;
    middle_ = {(width - 1) / 2, (height - 1) / 2};
    half_diagonal_ = std::hypot(width, height) / 2;
    border_ = options.border * 2 * half_diagonal_;
    for (const OrthoView& view : scene.views) {
      const SE3 world_from_cam = view.cam_from_world.Inverse();
      views_.push_back({world_from_cam.translation(),
                        world_from_cam.rotation() * Eigen::Vector3d::UnitZ(),
                        scene.frame.ground_from_world(world_from_cam.translation())});
    }
    double highest = 0;
    cv::minMaxLoc(surface.height, nullptr, &highest, nullptr, nullptr,
                  surface.height == surface.height);
    highest_ = surface.base + highest;
  }

  Candidates ChooseAt(int column, int row, uint16_t* count) const {
    Candidates best;
    const Eigen::Vector3d ground = surface_.Node(column, row);
    const Eigen::Vector3d world = scene_.frame.world_from_ground(ground);
    for (size_t i = 0; i < views_.size(); ++i) {
      const Eigen::Vector3d ray = world - views_[i].centre_world;
      if (ray.dot(views_[i].axis_world) < cos_field_ * ray.norm()) continue;
      Candidate candidate{static_cast<int32_t>(i), 0, 0};
      if (!Rate(i, ground, world, &candidate)) continue;
      if (IsHidden(ground, views_[i].centre_ground)) {
        candidate.cost += static_cast<float>(options_.hidden_cost);
      } else {
        ++*count;
      }
      Insert(candidate, &best);
    }
    return best;
  }

 private:
  bool Rate(size_t view, const Eigen::Vector3d& ground, const Eigen::Vector3d& world,
            Candidate* candidate) const {
    const auto seen = Look(scene_.camera, scene_.views[view], world);
    if (!seen) return false;
    const Eigen::Vector2d& px = seen->px;
    const bool is_inside = px.x() >= border_ && px.y() >= border_ &&
                           px.x() <= scene_.camera.width - 1 - border_ &&
                           px.y() <= scene_.camera.height - 1 - border_;
    if (!is_inside) return false;
    const Eigen::Vector3d up = views_[view].centre_ground - ground;
    const double slope = up.head<2>().norm() / up.z();
    if (up.z() <= 0 || slope > max_tan_) return false;
    candidate->radius2 =
        static_cast<float>((px - middle_).squaredNorm() / (half_diagonal_ * half_diagonal_));
    const double coarse = std::max(0.0, std::log2(seen->depth / scene_.camera.pinhole.fx / gsd_));
    candidate->cost =
        static_cast<float>(options_.angle_weight * slope +
                           options_.centre_weight * static_cast<double>(candidate->radius2) +
                           options_.coarse_weight * coarse);
    return true;
  }

  /// Whether the surface rises above the ray on its way to the camera.
  bool IsHidden(const Eigen::Vector3d& ground, const Eigen::Vector3d& camera) const {
    // The surface errs about as much as it may change from node to node.
    constexpr double kStart = 2, kTolerance = 0.5;
    const double step = surface_.grid.step;
    const Eigen::Vector3d way = camera - ground;
    const double length = way.head<2>().norm();
    if (!(length > kStart * step)) return false;
    const Eigen::Vector3d move = way * (step / length);
    const int steps = static_cast<int>(length / step);
    Eigen::Vector3d at = ground + kStart * move;
    for (int i = static_cast<int>(kStart); i < steps && at.z() < highest_; ++i, at += move) {
      const Eigen::Vector2d node = surface_.grid.NodeOf(at.head<2>());
      const int column = static_cast<int>(std::lround(node.x()));
      const int row = static_cast<int>(std::lround(node.y()));
      if (!surface_.grid.Holds(column, row)) return false;
      const double top = surface_.base + static_cast<double>(surface_.height(row, column));
      if (top > at.z() + kTolerance * step) return true;
    }
    return false;
  }

  static void Insert(const Candidate& candidate, Candidates* best) {
    Candidate moving = candidate;
    for (Candidate& place : *best) {
      if (place.view >= 0 && place.cost <= moving.cost) continue;
      std::swap(place, moving);
      if (moving.view < 0) return;
    }
  }

  const OrthoScene& scene_;
  const Surface& surface_;
  const ViewChoiceOptions& options_;
  const double gsd_;
  std::vector<PreparedView> views_;
  double cos_field_ = 0, max_tan_ = 0, half_diagonal_ = 0, border_ = 0, highest_ = 0;
  Eigen::Vector2d middle_;
};

}  // namespace

void ViewChoiceOptions::Check() const { CheckOptions("", *this); }

ViewChoice ChooseViews(const OrthoScene& scene, const Surface& surface, double gsd,
                       const ViewChoiceOptions& options) {
  options.Check();
  const Chooser chooser(scene, surface, gsd, options);
  ViewChoice choice;
  choice.of_node.resize(surface.grid.size());
  choice.count = cv::Mat1w::zeros(surface.grid.rows, surface.grid.columns);
  cv::parallel_for_({0, surface.grid.rows}, [&](const cv::Range& rows) {
    for (int row = rows.start; row < rows.end; ++row) {
      for (int column = 0; column < surface.grid.columns; ++column) {
        if (!surface.Has(column, row)) continue;
        choice.of_node[surface.grid.Index(column, row)] =
            chooser.ChooseAt(column, row, &choice.count(row, column));
      }
    }
  });
  return choice;
}

double MedianGsd(const OrthoScene& scene, const std::vector<Eigen::Vector3d>& points_world) {
  constexpr size_t kMostPoints = 500;
  const size_t stride = std::max<size_t>(1, points_world.size() / kMostPoints);
  const Camera& camera = scene.camera;
  std::vector<double> distances;
  for (const OrthoView& view : scene.views) {
    for (size_t i = 0; i < points_world.size(); i += stride) {
      const auto seen = Look(camera, view, points_world[i]);
      const bool is_inside = seen && seen->px.x() >= 0 && seen->px.y() >= 0 &&
                             seen->px.x() < camera.width && seen->px.y() < camera.height;
      if (is_inside) distances.push_back(seen->depth / camera.pinhole.fx);
    }
  }
  if (distances.empty()) throw Error("no photograph shows a landmark of the map");
  return Median(std::move(distances));
}

}  // namespace deepuav
