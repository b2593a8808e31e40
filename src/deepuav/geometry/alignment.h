#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/geometry/sim3.h"

namespace deepuav {

enum class AlignmentKind {
  kRigid,    ///< SE(3): scale 1
  kSimilar,  ///< Sim(3)
  kYaw,      ///< rotation about z and translation, scale 1
};

/// The transform target_from_source that minimises the sum of squared distances |target_i - T
/// source_i|^2 (Umeyama 1991; yaw-only after Zhang and Scaramuzza 2018). Nothing for fewer than 3
/// points, or where the points leave the rotation open (all on a line; for kYaw, all on one
/// vertical).
std::optional<Sim3> Align(const std::vector<Eigen::Vector3d>& source,
                          const std::vector<Eigen::Vector3d>& target, AlignmentKind kind);

}  // namespace deepuav
