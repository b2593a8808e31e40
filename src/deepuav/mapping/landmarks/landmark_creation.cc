#include "deepuav/mapping/landmarks/landmark_creation.h"

#include <algorithm>
#include <numbers>
#include <optional>

#include "deepuav/base/option_check.h"
#include "deepuav/geometry/triangulation.h"

namespace deepuav {
namespace {

std::vector<int> KeypointsWithoutLandmark(const Keyframe& keyframe) {
  std::vector<int> free;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].valid()) free.push_back(static_cast<int>(i));
  }
  return free;
}

bool ReprojectsWell(const Pinhole& pinhole, const SE3& cam_from_world, const Eigen::Vector3d& point,
                    const PixelMeasurement& measured, double max_chi_square) {
  const Eigen::Vector3d point_cam = cam_from_world * point;
  if (point_cam.z() <= 0) return false;
  const Eigen::Vector2d error_px = pinhole.Project(point_cam) - measured.px.cast<double>();
  return (Whitening(measured.noise) * error_px).squaredNorm() <= max_chi_square;
}

std::optional<Eigen::Vector3d> Triangulate(const Keyframe& a, const PixelMeasurement& measured_a,
                                           const Keyframe& b, const PixelMeasurement& measured_b,
                                           const Pinhole& pinhole, const CreationOptions& options) {
  const auto point =
      TriangulatePoint(a.cam_from_world, pinhole.Unproject(measured_a.px.cast<double>()),
                       b.cam_from_world, pinhole.Unproject(measured_b.px.cast<double>()));
  if (!point || !point->allFinite()) return std::nullopt;
  if (!ReprojectsWell(pinhole, a.cam_from_world, *point, measured_a, options.max_chi_square))
    return std::nullopt;
  if (!ReprojectsWell(pinhole, b.cam_from_world, *point, measured_b, options.max_chi_square))
    return std::nullopt;
  const Eigen::Vector3d centre_a = a.cam_from_world.InverseTranslation();
  const Eigen::Vector3d centre_b = b.cam_from_world.InverseTranslation();
  const double min_parallax = options.min_parallax_deg * std::numbers::pi / 180;
  if (ParallaxAngle(centre_a, centre_b, *point) < min_parallax) return std::nullopt;
  const double ratio = (*point - centre_a).norm() / (*point - centre_b).norm();
  if (std::max(ratio, 1 / ratio) > options.max_distance_ratio) return std::nullopt;
  return point;
}

/// A landmark to be, and where its two views show it.
struct NewLandmark {
  Eigen::Vector3d position_world;
  PixelMeasurement measured_a, measured_b;
};

PixelMeasurement InAll(PixelMeasurement measured, double model_sigma_px) {
  measured.noise = measured.NoiseWith(model_sigma_px);
  return measured;
}

/// From what the detector says of the two views, then from b's patch found in a.
std::optional<NewLandmark> Propose(const Keyframe& a, const Keyframe& b, const Match& match,
                                   const Pinhole& pinhole, double model_sigma_px,
                                   const CreationOptions& options, const PatchObserver& observer) {
  const Keypoint& keypoint_a = a.features().keypoints[static_cast<size_t>(match.a)];
  const Keypoint& keypoint_b = b.features().keypoints[static_cast<size_t>(match.b)];
  NewLandmark proposed{Eigen::Vector3d::Zero(),
                       {keypoint_a.px, keypoint_a.sigma_px},
                       {keypoint_b.px, keypoint_b.sigma_px}};
  const auto triangulate = [&] {
    return Triangulate(a, InAll(proposed.measured_a, model_sigma_px), b,
                       InAll(proposed.measured_b, model_sigma_px), pinhole, options);
  };
  const auto detected = triangulate();
  if (!detected) return std::nullopt;
  proposed.position_world = *detected;
  const auto measured = observer.MeasurePair(b, match.b, *detected, a, match.a);
  if (!measured) return proposed;
  proposed.measured_a = *measured;
  proposed.measured_b = *observer.ReferenceMeasurement(b, match.b, *detected);
  const auto sharp = triangulate();
  if (!sharp) return std::nullopt;
  proposed.position_world = *sharp;
  return proposed;
}

/// Of those that neither view has a landmark for yet, what `learned` finds near the epipolar lines.
std::vector<Match> MatchLearned(const Keyframe& a, const Keyframe& b, const Pinhole& pinhole,
                                const EpipolarOptions& options, Matcher* learned) {
  std::vector<Match> matches = learned->MatchFeatures(a.features(), b.features());
  std::erase_if(matches, [&](const Match& match) {
    return a.landmarks[static_cast<size_t>(match.a)].valid() ||
           b.landmarks[static_cast<size_t>(match.b)].valid();
  });
  return KeepEpipolar(matches, a.features(), b.features(), pinhole,
                      b.cam_from_world * a.cam_from_world.Inverse(), options);
}

std::vector<Match> MatchNearest(const Keyframe& a, const Keyframe& b, const Pinhole& pinhole,
                                const EpipolarOptions& options) {
  return MatchEpipolar(a.features(), KeypointsWithoutLandmark(a), b.features(),
                       KeypointsWithoutLandmark(b), pinhole,
                       b.cam_from_world * a.cam_from_world.Inverse(), options);
}

bool BaselineIsTooShort(const Map& map, const Keyframe& a, const Keyframe& b, double min_ratio) {
  const double baseline =
      (a.cam_from_world.InverseTranslation() - b.cam_from_world.InverseTranslation()).norm();
  return baseline < min_ratio * map.MedianDepth(b.id);
}

}  // namespace

void CreationOptions::Check() const {
  CheckOptions("mapping.creation", *this);
  epipolar.Check();
}

std::vector<LandmarkId> CreateLandmarks(Map* map, KeyframeId id, const Pinhole& pinhole,
                                        IdSource* ids, const CreationOptions& options,
                                        const PatchObserver& observer, Matcher* learned) {
  std::vector<LandmarkId> created;
  const Keyframe& keyframe = map->At(id);
  int learned_left = learned ? options.learned_neighbours : 0;
  for (KeyframeId neighbour_id : map->Covisible(id, 1, options.max_neighbours)) {
    const Keyframe& neighbour = map->At(neighbour_id);
    if (BaselineIsTooShort(*map, keyframe, neighbour, options.min_baseline_ratio)) continue;
    const auto create = [&](const std::vector<Match>& matches) {
      for (const Match& match : matches) {
        const auto proposed =
            Propose(keyframe, neighbour, match, pinhole, map->model_sigma_px(), options, observer);
        if (!proposed) continue;
        created.push_back(ids->NextLandmark());
        map->AddLandmark(created.back(), proposed->position_world, id);
        map->AddObservation(id, match.a, created.back(), proposed->measured_a);
        map->AddObservation(neighbour_id, match.b, created.back(), proposed->measured_b);
        map->UpdateAppearance(created.back());
      }
    };
    if (learned_left-- > 0)
      create(MatchLearned(keyframe, neighbour, pinhole, options.epipolar, learned));
    create(MatchNearest(keyframe, neighbour, pinhole, options.epipolar));
  }
  return created;
}

}  // namespace deepuav
