#include "deepuav/mapping/camera/readout_search.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/map/all_keyframes.h"
#include "deepuav/mapping/adjustment/bundle_window.h"

namespace deepuav {
namespace {

/// Of the distance that holds the map's scale, over itself: next to nothing.
constexpr double kScaleSigma = 1e-5;

/// How a landmark moves in the camera in a second of readout (BundleObservation), to first order:
/// the derivative of R(moment * turn)^T (point - moment * travel).
Eigen::Vector3d DriftPerS(const Eigen::Vector3d& point_cam, double moment,
                          const ReadoutMotion& motion_per_s) {
  return moment * (point_cam.cross(motion_per_s.turn_rad) - motion_per_s.travel);
}

/// When the row was read that shows an undistorted pixel of the middle row.
std::optional<double> MomentOf(const Eigen::Vector2d& px, const ReadoutMotion& known,
                               double inverse_depth, const Camera& camera) {
  const auto image_px = DistortInRow(camera, px, known, inverse_depth);
  if (!image_px) return std::nullopt;
  return RowMoment(image_px->y(), camera.height);
}

void AddDrifts(const Map& map, const Camera& camera,
               const std::map<KeyframeId, ReadoutMotion>& motion_per_s, BundleWindow* window) {
  BundleProblem& problem = window->problem;
  for (BundleObservation& observation : problem.observations) {
    const auto camera_index = static_cast<size_t>(observation.camera);
    const KeyframeId id = window->keyframes[camera_index];
    const auto motion = motion_per_s.find(id);
    if (motion == motion_per_s.end()) continue;
    const Eigen::Vector3d point =
        problem.cam_from_world[camera_index] *
        problem.landmarks_world[static_cast<size_t>(observation.landmark)];
    if (!(point.z() > 0)) continue;
    const auto moment = MomentOf(observation.px, map.At(id).motion(), 1 / point.z(), camera);
    if (moment) observation.drift_cam_per_s = DriftPerS(point, *moment, motion->second);
  }
}

/// A readout that the travel tells would else be changed for another scale of the map.
void HoldScale(BundleProblem* problem) {
  const auto centre = [&](size_t i) { return problem->cam_from_world[i].InverseTranslation(); };
  DistanceFactor farthest;
  for (size_t i = 1; i < problem->cam_from_world.size(); ++i) {
    const double distance = (centre(i) - centre(0)).norm();
    if (distance <= farthest.distance_world) continue;
    farthest.second_camera = static_cast<int>(i);
    farthest.distance_world = distance;
  }
  if (farthest.second_camera == 0) return;
  farthest.per_sigma = 1 / (kScaleSigma * farthest.distance_world);
  problem->factors.distances.push_back(farthest);
}

}  // namespace

void ReadoutSearchOptions::Check() const { CheckOptions("mapping.readout", *this); }

void ReadoutSearchOptions::CheckRelations() const {
  CheckOption(min_s < max_s, "min_s", min_s, "less than max_s");
}

bool IsBelieved(const FoundReadout& found, const ReadoutSearchOptions& options) {
  return found.cost_share >= options.min_cost_share && found.change_s >= options.min_s &&
         found.change_s <= options.max_s && found.change_s >= options.min_sigmas * found.sigma_s;
}

bool IsOff(const FoundReadout& found, const ReadoutSearchOptions& options) {
  return std::abs(found.change_s) >= options.off_sigmas * found.sigma_s;
}

std::optional<FoundReadout> FindReadout(const Map& map, const Camera& camera,
                                        const std::map<KeyframeId, ReadoutMotion>& motion_per_s,
                                        const BundleOptions& bundle,
                                        const ReadoutSearchOptions& options,
                                        const std::function<bool()>& stop) {
  if (static_cast<int>(motion_per_s.size()) < options.min_keyframes) return std::nullopt;
  BundleWindow window = MakeBundleWindow(map, AllKeyframes(map), camera.pinhole);
  BundleProblem& problem = window.problem;
  problem.focal_guess_px = camera.pinhole.fx;
  problem.centre_guess_px = Eigen::Vector2d(camera.pinhole.cx, camera.pinhole.cy);
  HoldScale(&problem);
  // The map was adjusted otherwise, to errors as they show themselves: that is nothing to compare.
  const double known_cost = AdjustBundle(&problem, bundle, stop).final_cost;
  AddDrifts(map, camera, motion_per_s, &window);
  BundleOptions freed = bundle;
  freed.refine_readout = true;
  const double freed_cost = AdjustBundle(&problem, freed, stop).final_cost;
  if ((stop && stop()) || !(known_cost > 0)) return std::nullopt;
  const auto sigmas = EstimateCalibrationSigmas(problem, freed);
  if (!sigmas) return std::nullopt;
  FoundReadout found{problem.readout_s, sigmas->readout_s, 1 - freed_cost / known_cost};
  Log().debug("a readout of {:.2f} ms more ({:.2f}) saves {:.2f} % of the errors of map {}",
              1000 * found.change_s, 1000 * found.sigma_s, 100 * found.cost_share, map.id().value);
  return found;
}

}  // namespace deepuav
