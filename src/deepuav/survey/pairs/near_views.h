#pragma once

#include <Eigen/Core>
#include <optional>
#include <set>
#include <vector>

namespace deepuav {

/// For each view those taken nearest to it in plan, `count` on six sides of it, so that
/// neighbouring lines are among them where the views of a line lie close together; without the
/// `in_order` before and after it, which are its neighbours anyway, and without what lies far
/// beyond the others. Of two views either is near the other. Views of which no position is known
/// are near none.
std::vector<std::set<int>> NearViews(const std::vector<std::optional<Eigen::Vector3d>>& positions_m,
                                     int count, int in_order = 0);

}  // namespace deepuav
