#include "deepuav/system/finish/pose_covariances.h"

#include <Eigen/Cholesky>

namespace deepuav {
namespace {

/// What the frame's own pixels leave open, in the map's present units; nothing where unknown.
std::optional<Matrix6d> OwnCovariance(const FrameRecord& record, const Keyframe& keyframe) {
  const Eigen::LLT<Matrix6d> factor(record.pose_information);
  if (factor.info() != Eigen::Success || !(record.pose.keyframe_scale > 0)) return std::nullopt;
  Matrix6d covariance = factor.solve(Matrix6d::Identity());
  const double growth = keyframe.scale / record.pose.keyframe_scale;
  covariance.topRows<3>() *= growth;
  covariance.leftCols<3>() *= growth;
  return covariance.allFinite() ? std::optional(covariance) : std::nullopt;
}

}  // namespace

MapCovariances EstimateMapCovariances(const Atlas& atlas, const Pinhole& pinhole,
                                      const BundleOptions& options,
                                      const std::map<MapId, GeoreferenceReport>& fixes,
                                      const std::function<bool()>& stop) {
  MapCovariances covariances;
  for (const MapId map : atlas.Remaining()) {
    if (stop && stop()) break;
    const auto placed = fixes.find(map);
    const bool by_fixes = placed != fixes.end() && placed->second.found;
    covariances[map] = EstimateKeyframeCovariances(atlas.At(map), pinhole, options,
                                                   by_fixes ? &placed->second.factors : nullptr,
                                                   atlas.GaugeOf(map).scale_sigma);
  }
  return covariances;
}

std::optional<Matrix6d> PoseCovariance(const FrameRecord& record, const Atlas& atlas,
                                       const MapCovariances& covariances) {
  if (!record.located() || record.inferred || record.reckoned) return std::nullopt;
  const Map& map = atlas.At(atlas.Current(record.map));
  const auto of_map = covariances.find(map.id());
  if (of_map == covariances.end()) return std::nullopt;
  const auto found = of_map->second.find(map.Remaining(record.pose.keyframe));
  if (found == of_map->second.end()) return std::nullopt;
  const Keyframe& keyframe = map.At(found->first);
  const SE3 frame_from_keyframe = record.cam_from_world * keyframe.cam_from_world.Inverse();
  // How a twist from the left moves when the frame stands before it.
  const Matrix6d adjoint =
      Sim3(1, frame_from_keyframe.rotation(), frame_from_keyframe.translation())
          .Adjoint()
          .topLeftCorner<6, 6>();
  Matrix6d covariance = adjoint * found->second * adjoint.transpose();
  if (record.id != keyframe.frame.id) {
    const std::optional<Matrix6d> own = OwnCovariance(record, keyframe);
    if (!own) return std::nullopt;
    covariance += *own;
  }
  // The camera's centre moves by the translation turned into the world, against its sense.
  Matrix6d to_world = Matrix6d::Zero();
  to_world.topLeftCorner<3, 3>() = to_world.bottomRightCorner<3, 3>() =
      record.cam_from_world.RotationMatrix().transpose();
  return to_world * covariance * to_world.transpose();
}

}  // namespace deepuav
