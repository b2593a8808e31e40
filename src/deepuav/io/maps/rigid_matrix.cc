#include "deepuav/io/maps/rigid_matrix.h"

#include "deepuav/base/error.h"

namespace deepuav {

SE3 RigidFromRows(std::span<const double, 12> rows, const std::string& where,
                  const std::string& field) {
  constexpr double kTolerance = 1e-3;
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(rows.data());
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const double deviation =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(deviation < kTolerance) || !(rotation.determinant() > 0)) {
    throw Error(
        "{}: {} holds no rotation (R'R differs from 1 by {:.3g}, determinant {:.3g}): expected an "
        "orthonormal right-handed 3x3 part",
        where, field, deviation, rotation.determinant());
  }
  return SE3(rotation, matrix.col(3));
}

}  // namespace deepuav
