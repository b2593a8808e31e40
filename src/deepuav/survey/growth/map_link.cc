#include "deepuav/survey/growth/map_link.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "deepuav/estimation/solvers/damped_gauss_newton.h"

namespace deepuav {
namespace {

/// A point of one map in a photograph of the other.
struct CrossSight {
  Eigen::Vector3d point;  ///< In the world of its map.
  SE3 cam_from_world;     ///< Of the photograph, in the world of the other.
  Eigen::Vector2d px;     ///< Undistorted.
  double sigma_px = 1;
  bool is_point_of_side = false;
  int view = 0;
};

/// A photograph that both maps have a pose of.
struct CommonView {
  int view = 0;
  Eigen::Quaterniond main_from_side;
  Eigen::Vector3d in_main, in_side;
};

class LinkSearch {
 public:
  LinkSearch(const Tracks& tracks, const ViewPixels& px, const SurveyState& main,
             const SurveyState& side, const std::set<int>& outside, double max_error_px)
      : lens_(main.lens), max_error_px_(max_error_px) {
    for (size_t t = 0; t < tracks.tracks.size(); ++t) {
      if (!IsSeenFrom(outside, tracks.tracks[t])) continue;
      for (const Track::Sight& sight : tracks.tracks[t].sights) {
        const bool is_outside = outside.contains(sight.view);
        const SurveyState& of_point = is_outside ? main : side;
        const SurveyState& of_view = is_outside ? side : main;
        if (of_point.points[t] && of_view.Has(sight.view))
          Add(*of_point.points[t], of_view, sight, px, !is_outside);
      }
    }
    for (size_t v = 0; v < main.cam_from_world.size(); ++v) {
      const auto& in_main = main.cam_from_world[v];
      const auto& in_side = side.cam_from_world[v];
      if (!in_main || !in_side) continue;
      common_.push_back({static_cast<int>(v), in_main->rotation().conjugate() * in_side->rotation(),
                         in_main->InverseTranslation(), in_side->InverseTranslation()});
    }
  }

  /// Refined from where most sights agree roughly, of scales that single sights give.
  std::optional<MapLink> Find() const {
    std::vector<Hypothesis> hypotheses;
    for (const CommonView& common : common_) {
      for (const CrossSight* sight : DrawnBeside(common.view)) {
        const double scale = ScaleBy(*sight, common);
        if (!std::isfinite(scale) || scale <= 0) continue;
        const Sim3 link(scale, common.main_from_side,
                        common.in_main - scale * (common.main_from_side * common.in_side));
        const auto agreeing = Within(link, kLimits[0] * max_error_px_).size();
        hypotheses.push_back({link, common.in_main, agreeing});
      }
    }
    std::ranges::stable_sort(hypotheses, std::greater(), &Hypothesis::agreeing);
    std::optional<MapLink> best;
    for (size_t i = 0; i < std::min(hypotheses.size(), kMostRefined); ++i) {
      const MapLink link = Refined(hypotheses[i].main_from_side, hypotheses[i].about);
      if (!best || link.agreeing > best->agreeing) best = link;
    }
    return best;
  }

 private:
  using Equations = NormalEquations<7>;

  struct Hypothesis {
    Sim3 main_from_side;
    Eigen::Vector3d about;  ///< A place near the photographs, in main.
    size_t agreeing = 0;
  };

  /// Sights that scales are taken from, of each common view; hypotheses that are refined.
  static constexpr size_t kMostDrawn = 200, kMostRefined = 20;
  /// By which sights agree from step to step, over the final one: the common view's pose is known
  /// from few points.
  static constexpr double kLimits[] = {16, 8, 4, 2, 1};

  /// What a single common view sees agrees at any scale.
  bool Tells(const CrossSight& sight) const {
    return common_.size() > 1 || sight.view != common_.front().view;
  }

  /// What two photographs of the map see of the same point says nothing of those outside.
  static bool IsSeenFrom(const std::set<int>& outside, const Track& track) {
    return std::ranges::any_of(
        track.sights, [&](const Track::Sight& sight) { return outside.contains(sight.view); });
  }

  /// Evenly over all sights in other views, which are in the order of their tracks.
  std::vector<const CrossSight*> DrawnBeside(int view) const {
    std::vector<const CrossSight*> beside, drawn;
    for (const CrossSight& sight : sights_) {
      if (sight.view != view) beside.push_back(&sight);
    }
    const size_t count = std::min(beside.size(), kMostDrawn);
    for (size_t i = 0; i < count; ++i) drawn.push_back(beside[i * beside.size() / count]);
    return drawn;
  }

  void Add(const Eigen::Vector3d& point, const SurveyState& of_view, const Track::Sight& sight,
           const ViewPixels& px, bool is_point_of_side) {
    const SightPixel& seen =
        px[static_cast<size_t>(sight.view)][static_cast<size_t>(sight.keypoint)];
    if (const auto straight = lens_.Undistort(seen.px))
      sights_.push_back({point, *of_view.cam_from_world[static_cast<size_t>(sight.view)], *straight,
                         seen.noise.SigmaPx(), is_point_of_side, sight.view});
  }

  /// Under which the sight agrees best, the common view being where and turned as both have it.
  double ScaleBy(const CrossSight& sight, const CommonView& common) const {
    const Eigen::Vector3d ray = lens_.camera.pinhole.Unproject(sight.px);
    const Eigen::Quaterniond& turn = common.main_from_side;
    const Eigen::Vector3d& from = sight.is_point_of_side ? common.in_side : common.in_main;
    const Eigen::Vector3d& to = sight.is_point_of_side ? common.in_main : common.in_side;
    const Eigen::Vector3d along =
        (sight.is_point_of_side ? turn : turn.conjugate()) * (sight.point - from);
    const Eigen::Vector3d of_centre = (sight.cam_from_world * to).cross(ray);
    const Eigen::Vector3d of_scale = (sight.cam_from_world.rotation() * along).cross(ray);
    const double scale = -of_centre.dot(of_scale) / of_scale.squaredNorm();
    return sight.is_point_of_side ? scale : 1 / scale;
  }

  /// In standard deviations; nothing behind the camera.
  std::optional<Eigen::Vector2d> ErrorOf(const CrossSight& sight, const Sim3& main_from_side,
                                         const Sim3& side_from_main) const {
    const Sim3& moved = sight.is_point_of_side ? main_from_side : side_from_main;
    const Eigen::Vector3d point_cam = sight.cam_from_world * (moved * sight.point);
    if (!InFrontOfCamera(point_cam)) return std::nullopt;
    return (lens_.camera.pinhole.Project(point_cam) - sight.px) / sight.sigma_px;
  }

  std::vector<const CrossSight*> Within(const Sim3& main_from_side, double limit) const {
    const Sim3 inverse = main_from_side.Inverse();
    std::vector<const CrossSight*> within;
    for (const CrossSight& sight : sights_) {
      const auto error = ErrorOf(sight, main_from_side, inverse);
      if (error && error->norm() < limit) within.push_back(&sight);
    }
    return within;
  }

  /// Steps are turns, shifts and growth about a place near the photographs.
  static Sim3 Moved(const Sim3& main_from_side, const Vector7d& step,
                    const Eigen::Vector3d& about) {
    const Eigen::Quaterniond none = Eigen::Quaterniond::Identity();
    return Sim3(1, none, about) * Sim3::Exp(step) * Sim3(1, none, -about) * main_from_side;
  }

  Equations Linearise(const std::vector<const CrossSight*>& sights, const Sim3& main_from_side,
                      const Eigen::Vector3d& about) const {
    constexpr double kStep = 1e-6;
    std::array<Sim3, 7> stepped, stepped_inverse;
    for (int i = 0; i < 7; ++i) {
      const auto at = static_cast<size_t>(i);
      stepped[at] = Moved(main_from_side, kStep * Vector7d::Unit(i), about);
      stepped_inverse[at] = stepped[at].Inverse();
    }
    const Sim3 inverse = main_from_side.Inverse();
    Equations equations;
    for (const CrossSight* sight : sights) {
      const auto error = ErrorOf(*sight, main_from_side, inverse);
      Eigen::Matrix<double, 2, 7> jacobian;
      bool is_seen = error.has_value();
      for (int i = 0; is_seen && i < 7; ++i) {
        const auto at = static_cast<size_t>(i);
        const auto moved = ErrorOf(*sight, stepped[at], stepped_inverse[at]);
        if (is_seen = moved.has_value(); is_seen) jacobian.col(i) = (*moved - *error) / kStep;
      }
      if (!is_seen) {
        equations.cost = std::numeric_limits<double>::infinity();
        return equations;
      }
      equations.hessian += jacobian.transpose() * jacobian;
      equations.gradient += jacobian.transpose() * *error;
      equations.cost += error->squaredNorm() / 2;
    }
    return equations;
  }

  /// By the sights that agree, roughly at first.
  MapLink Refined(const Sim3& main_from_side, const Eigen::Vector3d& about) const {
    constexpr int kIterations = 10, kLeastSights = 4;
    MapLink link{main_from_side};
    for (const CrossSight& sight : sights_) link.sights += Tells(sight);
    for (const double times : kLimits) {
      const auto within = Within(link.main_from_side, times * max_error_px_);
      if (std::ssize(within) < kLeastSights) return link;
      link.main_from_side = MinimiseDamped(
          link.main_from_side, kIterations,
          [&](const Sim3& at) { return Linearise(within, at, about); },
          [&](const Sim3& at, const Vector7d& step) { return Moved(at, step, about); });
    }
    const auto agreeing = Within(link.main_from_side, max_error_px_);
    link.agreeing = static_cast<int>(
        std::ranges::count_if(agreeing, [this](const CrossSight* sight) { return Tells(*sight); }));
    const Matrix7d hessian = Linearise(agreeing, link.main_from_side, about).hessian;
    const Eigen::LLT<Matrix7d> factor(hessian);
    link.scale_sigma = factor.info() == Eigen::Success
                           ? std::sqrt(factor.solve(Vector7d::Unit(6))[6])
                           : std::numeric_limits<double>::infinity();
    return link;
  }

  const SurveyLens& lens_;
  const double max_error_px_;
  std::vector<CrossSight> sights_;
  std::vector<CommonView> common_;
};

}  // namespace

std::optional<MapLink> FindMapLink(const Tracks& tracks, const ViewPixels& px,
                                   const SurveyState& main, const SurveyState& side,
                                   const std::set<int>& outside, double max_error_px) {
  return LinkSearch(tracks, px, main, side, outside, max_error_px).Find();
}

}  // namespace deepuav
