#include "deepuav/estimation/paths/gap_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "deepuav/estimation/solvers/block_values.h"

namespace deepuav {
namespace {

constexpr double kConvergedStep = 1e-7;  // standard units of the parameters
constexpr double kMaxTurnRad = 0.3;      // a step, within which equations hold

/// What of a step moves a pose, or changes its pace.
constexpr int kPoseSize = 6;

/// The symmetric matrix of a path's equations, of blocks of which few are not zero.
class PathEquations {
 public:
  /// `pairs`: of the blocks, but for the diagonal ones, that are not zero: row > column.
  PathEquations(int blocks, std::vector<std::pair<int, int>> pairs)
      : hessian_(BlockPattern::OfPairs(blocks, std::move(pairs))),
        gradient_(Eigen::VectorXd::Zero(kPoseSize * blocks)),
        cholesky_(hessian_.pattern()) {}

  void Clear() {
    hessian_.Clear();
    gradient_.setZero();
  }
  /// Below the diagonal and on it, the rest follows; -1 is what stays.
  void Add(int row, int column, const Matrix6d& block) {
    if (column >= 0 && row >= column) hessian_.At(row, column) += block;
  }
  void AddGradient(int row, const Vector6d& gradient) {
    if (row >= 0) gradient_.segment<kPoseSize>(kPoseSize * row) += gradient;
  }

  /// Nothing where there is no finite step.
  std::optional<Eigen::VectorXd> Step() {
    if (!Factorise()) return std::nullopt;
    Eigen::Matrix<double, Eigen::Dynamic, 1> step = -gradient_;
    cholesky_.SolveInPlace(&step);
    return step.allFinite() ? std::optional<Eigen::VectorXd>(step) : std::nullopt;
  }
  /// False where nothing is known of a part.
  bool Factorise() { return cholesky_.Factorise(hessian_.data()); }
  /// A diagonal block of the inverse, once factorised. (Takahashi's recursion, which gives all of
  /// them at once, loses every digit on a long chain of paces.)
  Matrix6d Covariance(int block) const {
    Eigen::Matrix<double, Eigen::Dynamic, kPoseSize> columns =
        Eigen::Matrix<double, Eigen::Dynamic, kPoseSize>::Zero(gradient_.size(), kPoseSize);
    columns.middleRows<kPoseSize>(kPoseSize * block).setIdentity();
    cholesky_.SolveInPlace(&columns);
    return columns.middleRows<kPoseSize>(kPoseSize * block);
  }

 private:
  BlockValues<kPoseSize> hessian_;
  Eigen::VectorXd gradient_;
  BlockCholesky<kPoseSize> cholesky_;
};

/// A row of the plane at right angles to a bearing.
Eigen::Matrix<double, 2, 3> TangentOf(const Eigen::Vector3d& bearing) {
  const Eigen::Vector3d x = bearing.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> tangent;
  tangent << x.transpose(), bearing.cross(x).transpose();
  return tangent;
}

/// Error and Jacobian of a landmark in pixels, whitened.
struct LandmarkError {
  Eigen::Vector2d error = Eigen::Vector2d::Zero();
  Matrix26d by_camera = Matrix26d::Zero();
  bool is_usable = false;
};

LandmarkError LineariseLandmark(const Pinhole& pinhole, const MovingCamera& camera,
                                const PoseObservation& observation) {
  LandmarkError result;
  const Eigen::Matrix3d cam_from_world = camera.world_from_cam.conjugate().toRotationMatrix();
  const Eigen::Vector3d point = cam_from_world * (observation.landmark_world - camera.centre_world);
  if (!InFrontOfCamera(point) || !observation.noise.usable()) return result;
  const Whitening whitening(observation.noise);
  const Matrix23d by_point = whitening * pinhole.ProjectJacobian(point);
  result.error = whitening * Eigen::Vector2d(pinhole.Project(point) - observation.px);
  result.by_camera.leftCols<3>() = -by_point * cam_from_world;
  result.by_camera.rightCols<3>() = by_point * Skew(point);
  result.is_usable = true;
  return result;
}

class GapPathSolver {
 public:
  GapPathSolver(const Pinhole& pinhole, const GapPathProblem& problem,
                const GapPathOptions& options)
      : pinhole_(pinhole), problem_(problem), options_(options) {
    for (const PathFrame& frame : problem.frames) {
      cameras_.emplace_back(frame.cam_from_world);
      landmark_active_.emplace_back(frame.landmarks.size(), 1);
      pose_at_.push_back(frame.is_known ? -1 : blocks_++);
      pace_at_.push_back(blocks_++);
    }
    for (const FrameLink& link : problem.links) pair_active_.emplace_back(link.pairs.size(), 1);
    equations_.emplace(blocks_, Pairs());
    StartPaces();
  }

  /// False where the equations have no finite solution.
  bool Solve() {
    for (int round = 0; round < options_.rounds; ++round) {
      const bool robust = round + 1 < options_.rounds || options_.rounds == 1;
      for (int i = 0; i < options_.iterations; ++i) {
        Linearise(robust);
        const std::optional<double> moved = Step();
        if (!moved) return false;
        if (*moved < kConvergedStep) break;
      }
      if (robust) Classify();
    }
    return true;
  }

  std::optional<GapPath> Result() {
    Linearise(false);
    if (!equations_->Factorise()) return std::nullopt;
    GapPath path;
    for (size_t i = 0; i < cameras_.size(); ++i) {
      GapPath::Pose pose{cameras_[i].CamFromWorld()};
      if (pose_at_[i] >= 0 && options_.covariances) {
        // The twist from the left moves the centre by -R and turns the other way.
        Matrix6d by_parameters = -Matrix6d::Identity();
        by_parameters.topLeftCorner<3, 3>() = -pose.cam_from_world.RotationMatrix();
        pose.covariance =
            by_parameters * equations_->Covariance(pose_at_[i]) * by_parameters.transpose();
        if (!pose.covariance.allFinite()) return std::nullopt;
      }
      pose.landmark_count = Count(landmark_active_[i]);
      path.poses.push_back(pose);
    }
    path.link_inlier = pair_active_;
    for (const auto& active : pair_active_) path.link_inlier_count.push_back(Count(active));
    AddMisfits(&path);
    return path;
  }

 private:
  static int Count(const std::vector<uint8_t>& active) {
    return static_cast<int>(std::count(active.begin(), active.end(), 1));
  }

  /// The blocks of the equations that are not zero, below the diagonal.
  std::vector<std::pair<int, int>> Pairs() const {
    std::vector<std::pair<int, int>> pairs;
    const auto add = [&pairs](int a, int b) {
      if (a >= 0 && b >= 0 && a != b) pairs.emplace_back(std::max(a, b), std::min(a, b));
    };
    for (size_t i = 0; i < cameras_.size(); ++i) {
      add(pose_at_[i], pace_at_[i]);
      if (i + 1 == cameras_.size()) break;
      for (const int from : {pose_at_[i], pace_at_[i]}) {
        for (const int to : {pose_at_[i + 1], pace_at_[i + 1]}) add(from, to);
      }
    }
    for (const FrameLink& link : problem_.links)
      add(pose_at_[static_cast<size_t>(link.a)], pose_at_[static_cast<size_t>(link.b)]);
    return pairs;
  }

  double StepSeconds(size_t i) const {
    return problem_.frames[i + 1].time_s - problem_.frames[i].time_s;
  }

  /// Each frame moves on as to the next.
  void StartPaces() {
    for (size_t i = 0; i + 1 < cameras_.size(); ++i) {
      const MovingCamera& next = cameras_[i + 1];
      MovingCamera& camera = cameras_[i];
      camera.velocity_world_per_s = (next.centre_world - camera.centre_world) / StepSeconds(i);
      camera.turn_cam_rad_per_s =
          RotationLog(camera.world_from_cam.conjugate() * next.world_from_cam) / StepSeconds(i);
    }
    if (cameras_.size() < 2) return;
    const MovingCamera& before = cameras_[cameras_.size() - 2];
    cameras_.back().velocity_world_per_s = before.velocity_world_per_s;
    cameras_.back().turn_cam_rad_per_s = before.turn_cam_rad_per_s;
  }

  void Linearise(bool robust) {
    equations_->Clear();
    for (size_t i = 0; i + 1 < cameras_.size(); ++i) AddMotion(i);
    const HuberLoss loss{robust ? options_.chi_square : std::numeric_limits<double>::max()};
    for (size_t i = 0; i < cameras_.size(); ++i) AddLandmarks(i, loss);
    for (size_t i = 0; i < problem_.links.size(); ++i) AddLink(i, loss);
  }

  void AddMotion(size_t i) {
    std::array<MovingCameraMatrix, 2> by;
    const MovingCameraStep error = SmoothMotionError(cameras_[i], cameras_[i + 1], StepSeconds(i),
                                                     problem_.motion, by.data(), &by[1]);
    const std::array<int, 4> at = {pose_at_[i], pace_at_[i], pose_at_[i + 1], pace_at_[i + 1]};
    const auto part = [&by](size_t k) {
      return by[k / 2].middleCols<kPoseSize>(k % 2 == 0 ? kCentreAt : kVelocityAt);
    };
    for (size_t row = 0; row < at.size(); ++row) {
      for (size_t column = 0; column < at.size(); ++column)
        equations_->Add(at[row], at[column], part(row).transpose() * part(column));
      equations_->AddGradient(at[row], part(row).transpose() * error);
    }
  }

  void AddLandmarks(size_t i, const HuberLoss& loss) {
    if (pose_at_[i] < 0) return;
    const std::vector<PoseObservation>& landmarks = problem_.frames[i].landmarks;
    for (size_t k = 0; k < landmarks.size(); ++k) {
      if (!landmark_active_[i][k]) continue;
      const LandmarkError at = LineariseLandmark(pinhole_, cameras_[i], landmarks[k]);
      if (!at.is_usable) continue;
      const double weight = loss.Weight(at.error.squaredNorm());
      equations_->Add(pose_at_[i], pose_at_[i], weight * at.by_camera.transpose() * at.by_camera);
      equations_->AddGradient(pose_at_[i], weight * at.by_camera.transpose() * at.error);
    }
  }

  /// The error in standard deviations, with those that the distance leaves open.
  std::optional<BearingPairError> WhitenedPair(const FrameLink& link, size_t k) const {
    const BearingPair& pair = link.pairs[k];
    BearingPairError at =
        LineariseBearingPair(pinhole_, cameras_[static_cast<size_t>(link.a)],
                             cameras_[static_cast<size_t>(link.b)], pair, problem_.scene.mean);
    if (!at.is_usable) return std::nullopt;
    const Eigen::Vector2d along = problem_.scene.sigma * at.by_inverse_depth;
    const PixelNoise noise(Eigen::Matrix2d(
        pair.sigma_px * pair.sigma_px * Eigen::Matrix2d::Identity() + along * along.transpose()));
    const Whitening whitening(noise);
    at.error_px = whitening * at.error_px;
    at.by_a = whitening * at.by_a;
    at.by_b = whitening * at.by_b;
    return at;
  }

  void AddLink(size_t i, const HuberLoss& loss) {
    const FrameLink& link = problem_.links[i];
    const int a = pose_at_[static_cast<size_t>(link.a)];
    const int b = pose_at_[static_cast<size_t>(link.b)];
    const double share =
        std::min(1.0, options_.max_link_weight / std::max(1, Count(pair_active_[i])));
    for (size_t k = 0; k < link.pairs.size(); ++k) {
      if (!pair_active_[i][k]) continue;
      const std::optional<BearingPairError> at = WhitenedPair(link, k);
      if (!at) continue;
      const double weight = share * loss.Weight(at->error_px.squaredNorm());
      const Matrix6d mixed = weight * at->by_a.transpose() * at->by_b;
      equations_->Add(a, a, weight * at->by_a.transpose() * at->by_a);
      equations_->Add(b, b, weight * at->by_b.transpose() * at->by_b);
      equations_->Add(a, b, mixed);
      equations_->Add(b, a, mixed.transpose());
      equations_->AddGradient(a, weight * at->by_a.transpose() * at->error_px);
      equations_->AddGradient(b, weight * at->by_b.transpose() * at->error_px);
    }
  }

  /// The largest change of a parameter; nothing where there is no finite step.
  std::optional<double> Step() {
    std::optional<Eigen::VectorXd> step = equations_->Step();
    if (!step) return std::nullopt;
    double largest_turn = 0;
    for (const int at : pose_at_) {
      if (at < 0) continue;
      largest_turn =
          std::max(largest_turn, step->segment<3>(kPoseSize * at + kOrientationAt).norm());
    }
    if (largest_turn > kMaxTurnRad) *step *= kMaxTurnRad / largest_turn;
    for (size_t i = 0; i < cameras_.size(); ++i) {
      MovingCameraStep own = MovingCameraStep::Zero();
      if (pose_at_[i] >= 0)
        own.head<kPoseSize>() = step->segment<kPoseSize>(kPoseSize * pose_at_[i]);
      own.tail<kPoseSize>() = step->segment<kPoseSize>(kPoseSize * pace_at_[i]);
      cameras_[i] = Moved(cameras_[i], own);
    }
    return step->cwiseAbs().maxCoeff();
  }

  void Classify() {
    for (size_t i = 0; i < cameras_.size(); ++i) {
      const std::vector<PoseObservation>& landmarks = problem_.frames[i].landmarks;
      for (size_t k = 0; k < landmarks.size(); ++k) {
        const LandmarkError at = LineariseLandmark(pinhole_, cameras_[i], landmarks[k]);
        landmark_active_[i][k] = at.is_usable && at.error.squaredNorm() <= options_.chi_square;
      }
    }
    for (size_t i = 0; i < problem_.links.size(); ++i) {
      for (size_t k = 0; k < pair_active_[i].size(); ++k) {
        const std::optional<BearingPairError> at = WhitenedPair(problem_.links[i], k);
        pair_active_[i][k] = at && at->error_px.squaredNorm() <= options_.chi_square;
      }
    }
  }

  void AddMisfits(GapPath* path) const {
    for (size_t i = 0; i + 1 < cameras_.size(); ++i) {
      const MovingCameraStep error =
          SmoothMotionError(cameras_[i], cameras_[i + 1], StepSeconds(i), problem_.motion);
      path->travel_chi_square += error.head<kPoseSize>().squaredNorm();
      path->turn_chi_square += error.tail<kPoseSize>().squaredNorm();
    }
  }

  const Pinhole pinhole_;
  const GapPathProblem& problem_;
  const GapPathOptions options_;
  std::vector<MovingCamera> cameras_;
  /// The blocks of a frame's parameters; -1: its pose is known.
  std::vector<int> pose_at_, pace_at_;
  int blocks_ = 0;
  std::vector<std::vector<uint8_t>> landmark_active_, pair_active_;
  std::optional<PathEquations> equations_;
};

}  // namespace

BearingPairError LineariseBearingPair(const Pinhole& pinhole, const MovingCamera& a,
                                      const MovingCamera& b, const BearingPair& pair,
                                      double inverse_depth) {
  BearingPairError result;
  const Eigen::Vector3d ray = pinhole.Unproject(pair.a_px);
  const Eigen::Vector3d seen = pinhole.Unproject(pair.b_px).normalized();
  const Eigen::Matrix3d b_from_world = b.world_from_cam.conjugate().toRotationMatrix();
  const Eigen::Matrix3d b_from_a = b_from_world * a.world_from_cam.toRotationMatrix();
  const Eigen::Vector3d step = b_from_world * (a.centre_world - b.centre_world);
  const Eigen::Vector3d point = b_from_a * ray + inverse_depth * step;
  const double length = point.norm();
  const Eigen::Vector3d bearing = point / length;
  if (!(length > 0) || bearing.dot(seen) <= 0) return result;
  const double focal_px = std::sqrt(pinhole.fx * pinhole.fy);
  const Matrix23d tangent = focal_px * TangentOf(seen);
  const Matrix23d by_point =
      tangent * (Eigen::Matrix3d::Identity() - bearing * bearing.transpose()) / length;
  result.error_px = tangent * bearing;
  result.by_inverse_depth = by_point * step;
  result.by_a << inverse_depth * by_point * b_from_world, -by_point * b_from_a * Skew(ray);
  result.by_b << -inverse_depth * by_point * b_from_world, by_point * Skew(point);
  result.is_usable = true;
  return result;
}

std::optional<GapPath> SolveGapPath(const Pinhole& pinhole, const GapPathProblem& problem,
                                    const GapPathOptions& options) {
  if (problem.frames.size() < 2 || !problem.motion.usable()) return std::nullopt;
  GapPathSolver solver(pinhole, problem, options);
  if (!solver.Solve()) return std::nullopt;
  return solver.Result();
}

}  // namespace deepuav
