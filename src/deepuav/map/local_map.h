#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/features/descriptors.h"
#include "deepuav/map/map.h"
#include "deepuav/map/reference_view.h"

namespace deepuav {

/// A landmark as the Tracker needs it.
struct LocalLandmark {
  LandmarkId id;
  Eigen::Vector3d position_world;
  Eigen::Vector3d mean_view_direction;
  double min_distance = 0, max_distance = 0;
  int reference = -1;  ///< Index into LocalMap::keyframes: whose image shows the patch to look for.
  PixelMeasurement reference_measured = {};                  ///< Where.
  Eigen::Matrix3d position_noise = Eigen::Matrix3d::Zero();  ///< As of PositionNoise.
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();    ///< As of Landmark::SurfaceNormal.
};

/// A keyframe as the Tracker needs it.
struct LocalKeyframe {
  KeyframeId id;
  SE3 cam_from_world;
  double scale = 1;  ///< As Keyframe::scale.
  std::shared_ptr<const Features> features;
  std::vector<int> landmarks;  ///< Per key point an index into LocalMap::landmarks, or -1.
  std::shared_ptr<const ImagePyramid> image = {};  ///< May be null.
  ReadoutMotion motion = {};
};

/// The surroundings of one keyframe, by value: what the Mapper publishes and the Tracker works on.
/// Immutable.
struct LocalMap {
  MapId map;
  int centre = 0;                        ///< Index into `keyframes`: the one it was made around.
  std::vector<LocalKeyframe> keyframes;  ///< By id.
  std::vector<LocalLandmark> landmarks;  ///< By id.
  Descriptors descriptors;               ///< One row a landmark.
  double model_sigma_px = 0;             ///< As Map::model_sigma_px.
  int64_t revision = 0;                  ///< As Map::revision.
};

struct LocalMapOptions {
  int max_keyframes = 30;
  int min_shared_landmarks = 15;
  int max_landmarks = 6000;
  double max_heading_difference_deg = 30;
  ReferenceViewOptions reference = {};

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_keyframes", max_keyframes, "", "most keyframes of the local map",
          Between(2, 10'000));
    visit("min_shared_landmarks", min_shared_landmarks, "",
          "landmarks two keyframes share at least to be neighbours", Between(1, 1'000'000));
    visit("max_landmarks", max_landmarks, "",
          "most landmarks of the local map, those of the nearest keyframes first",
          Between(100, 1'000'000));
    visit("max_heading_difference_deg", max_heading_difference_deg, "deg",
          "in-plane rotation up to which a landmark's descriptor is recognised", Above(0, 180));
  }
};

/// Copies the keyframe, its covisible ones and theirs, with their landmarks.
std::shared_ptr<const LocalMap> MakeLocalMap(const Map& map, KeyframeId centre,
                                             const LocalMapOptions& options);

}  // namespace deepuav
