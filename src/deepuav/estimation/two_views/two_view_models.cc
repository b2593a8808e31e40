#include "deepuav/estimation/two_views/two_view_models.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "deepuav/estimation/two_views/usac.h"

namespace deepuav {
namespace {

// 95 % of the chi-square distribution with one (distance to a line) and two degrees of freedom
// (distance to a point). The bound of an inlier in pixels is the square root of the latter in
// sigmas.
constexpr double kChiSquareLine = 3.841;
constexpr double kChiSquarePoint = 5.991;
/// A translation smaller than this in distances to the plane is none.
constexpr double kMinPlaneTranslation = 1e-6;

struct Points {
  std::vector<cv::Point2d> a, b;
};

/// The finite pairs, at depth 1 of their cameras.
Points NormalisedPoints(const Pinhole& pinhole, const std::vector<PixelPair>& pairs) {
  Points points;
  for (const PixelPair& pair : pairs) {
    if (!Finite(pair)) continue;
    const Eigen::Vector3d a = pinhole.Unproject(pair.a_px), b = pinhole.Unproject(pair.b_px);
    points.a.emplace_back(a.x(), a.y());
    points.b.emplace_back(b.x(), b.y());
  }
  return points;
}

double FocalLength(const Pinhole& pinhole) { return std::sqrt(pinhole.fx * pinhole.fy); }

Eigen::Matrix3d CameraMatrix(const Pinhole& pinhole) {
  Eigen::Matrix3d matrix;
  matrix << pinhole.fx, 0, pinhole.cx, 0, pinhole.fy, pinhole.cy, 0, 0, 1;
  return matrix;
}

cv::UsacParams Params(const Pinhole& pinhole, uint64_t seed, const TwoViewOptions& options) {
  return MakeUsacParams(options.max_error_px / FocalLength(pinhole), options.confidence,
                        options.max_iterations, seed);
}

/// A 3x3 model from OpenCV's; nothing for an empty or degenerate one.
std::optional<Eigen::Matrix3d> FromOpenCv(const cv::Mat& mat) {
  if (mat.rows != 3 || mat.cols != 3) return std::nullopt;
  Eigen::Matrix3d matrix;
  cv::cv2eigen(mat, matrix);
  if (!matrix.allFinite() || matrix.norm() == 0) return std::nullopt;
  return matrix;
}

/// Adds the truncated errors of both images of a pair to the score (Mur-Artal 2015, equation 2).
void AddToScore(double squared_error_a, double squared_error_b, double bound, size_t pair,
                TwoViewModel* model) {
  const bool good_a = squared_error_a < bound, good_b = squared_error_b < bound;
  if (good_a) model->score += kChiSquarePoint - squared_error_a;
  if (good_b) model->score += kChiSquarePoint - squared_error_b;
  model->inlier[pair] = good_a && good_b;
}

void ScoreHomography(const std::vector<PixelPair>& pairs, double sigma_px, TwoViewModel* model) {
  const Eigen::Matrix3d a_from_b = model->matrix.inverse();
  model->inlier.assign(pairs.size(), 0);
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d in_b = model->matrix * pairs[i].a_px.homogeneous();
    const Eigen::Vector3d in_a = a_from_b * pairs[i].b_px.homogeneous();
    AddToScore((in_a.hnormalized() - pairs[i].a_px).squaredNorm() / (sigma_px * sigma_px),
               (in_b.hnormalized() - pairs[i].b_px).squaredNorm() / (sigma_px * sigma_px),
               kChiSquarePoint, i, model);
  }
}

double SquaredLineDistance(const Eigen::Vector3d& line, const Eigen::Vector2d& point) {
  const double value = line.dot(point.homogeneous());
  return value * value / line.head<2>().squaredNorm();
}

void ScoreFundamental(const std::vector<PixelPair>& pairs, double sigma_px, TwoViewModel* model) {
  model->inlier.assign(pairs.size(), 0);
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d line_b = model->matrix * pairs[i].a_px.homogeneous();
    const Eigen::Vector3d line_a = model->matrix.transpose() * pairs[i].b_px.homogeneous();
    AddToScore(SquaredLineDistance(line_a, pairs[i].a_px) / (sigma_px * sigma_px),
               SquaredLineDistance(line_b, pairs[i].b_px) / (sigma_px * sigma_px), kChiSquareLine,
               i, model);
  }
}

double SigmaPx(const TwoViewOptions& options) {
  return options.max_error_px / std::sqrt(kChiSquarePoint);
}

/// Malis and Vargas 2007: up to four poses of a homography between normalised points.
std::vector<SE3> DecomposeHomography(const Eigen::Matrix3d& homography) {
  cv::Mat matrix;
  // Both cameras on the same side of the plane: the determinant is positive.
  cv::eigen2cv(homography.determinant() < 0 ? Eigen::Matrix3d(-homography) : homography, matrix);
  std::vector<cv::Mat> rotations, translations, normals;
  cv::decomposeHomographyMat(matrix, cv::Mat::eye(3, 3, CV_64F), rotations, translations, normals);
  std::vector<SE3> poses;
  for (size_t i = 0; i < rotations.size(); ++i) {
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
    cv::cv2eigen(rotations[i], rotation);
    cv::cv2eigen(translations[i], translation);
    if (!rotation.allFinite() || !(translation.norm() > kMinPlaneTranslation)) continue;
    poses.emplace_back(rotation, translation.normalized());
  }
  return poses;
}

/// Hartley and Zisserman 9.6.2: the four poses of an essential matrix.
std::vector<SE3> DecomposeEssential(const Eigen::Matrix3d& essential) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (u.determinant() < 0) u = -u;
  if (v.determinant() < 0) v = -v;
  Eigen::Matrix3d quarter_turn;
  quarter_turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Matrix3d first = u * quarter_turn * v.transpose();
  const Eigen::Matrix3d second = u * quarter_turn.transpose() * v.transpose();
  const Eigen::Vector3d baseline = u.col(2);
  return {SE3(first, baseline), SE3(first, -baseline), SE3(second, baseline),
          SE3(second, -baseline)};
}

}  // namespace

bool Finite(const PixelPair& pair) { return pair.a_px.allFinite() && pair.b_px.allFinite(); }

std::optional<TwoViewModel> EstimateHomography(const Pinhole& pinhole,
                                               const std::vector<PixelPair>& pairs, uint64_t seed,
                                               const TwoViewOptions& options) {
  constexpr size_t kMinimalPairs = 4;
  const Points points = NormalisedPoints(pinhole, pairs);
  if (points.a.size() < kMinimalPairs) return std::nullopt;
  try {
    const auto homography = FromOpenCv(
        cv::findHomography(points.a, points.b, cv::noArray(), Params(pinhole, seed, options)));
    if (!homography) return std::nullopt;
    const Eigen::Matrix3d camera = CameraMatrix(pinhole);
    TwoViewModel model;
    model.matrix = camera * *homography * camera.inverse();
    ScoreHomography(pairs, SigmaPx(options), &model);
    model.b_from_a = DecomposeHomography(*homography);
    return model;
  } catch (const cv::Exception&) {
    return std::nullopt;  // OpenCV throws where degenerate points leave a solver without a model.
  }
}

std::optional<TwoViewModel> EstimateEssential(const Pinhole& pinhole,
                                              const std::vector<PixelPair>& pairs, uint64_t seed,
                                              const TwoViewOptions& options) {
  constexpr size_t kMinimalPairs = 6;
  const Points points = NormalisedPoints(pinhole, pairs);
  if (points.a.size() < kMinimalPairs) return std::nullopt;
  const cv::Mat identity = cv::Mat::eye(3, 3, CV_64F);
  try {
    const auto essential = FromOpenCv(
        cv::findEssentialMat(points.a, points.b, identity, identity, cv::noArray(), cv::noArray(),
                             cv::noArray(), Params(pinhole, seed, options)));
    if (!essential) return std::nullopt;
    const Eigen::Matrix3d from_pixel = CameraMatrix(pinhole).inverse();
    TwoViewModel model;
    model.matrix = from_pixel.transpose() * *essential * from_pixel;
    ScoreFundamental(pairs, SigmaPx(options), &model);
    model.b_from_a = DecomposeEssential(*essential);
    return model;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

}  // namespace deepuav
