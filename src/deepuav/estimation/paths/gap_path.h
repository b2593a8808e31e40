#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "deepuav/estimation/paths/smooth_motion.h"
#include "deepuav/estimation/poses/motion_only.h"
#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/geometry/camera.h"

namespace deepuav {

/// One thing that two frames show.
struct BearingPair {
  Eigen::Vector2d a_px, b_px;
  double sigma_px = 1;  ///< Of both together, per axis.
};

/// What two frames both show, at distances that are not known.
struct FrameLink {
  int a = 0, b = 0;
  std::vector<BearingPair> pairs;
};

/// A frame of a stretch of the path.
struct PathFrame {
  double time_s = 0;
  SE3 cam_from_world;     ///< To start from; of a frame that is known: as it stays.
  bool is_known = false;  ///< Its pose; never how it moves.
  std::vector<PoseObservation> landmarks;
};

/// How far away what the camera sees is: 1 / distance along the axis of the camera, in units of the
/// map, and by how much that varies.
struct InverseDepth {
  double mean = 0, sigma = 0;
};

/// A stretch of the path on which some poses are not known.
struct GapPathProblem {
  std::vector<PathFrame> frames;  ///< By growing time.
  std::vector<FrameLink> links;
  MotionNoise motion;
  InverseDepth scene;
};

struct GapPathOptions {
  int rounds = 4;      ///< After each, pairs and landmarks that do not agree are set aside anew.
  int iterations = 8;  ///< Gauss-Newton steps a round.
  double chi_square = 5.991;   ///< As MotionOnlyOptions::chi_square.
  double max_link_weight = 2;  ///< Pairs that a link counts for at most: what follows an edge, or
                               ///< lies on one near thing, errs together.
  bool covariances = true;     ///< Those of the poses; else they are zero.
};

struct GapPath {
  struct Pose {
    SE3 cam_from_world;
    /// Of the twist [translation; rotation] that moves it from the left; zero of a known pose.
    Matrix6d covariance = Matrix6d::Zero();
    int landmark_count = 0;  ///< That agree.
  };
  std::vector<Pose> poses;                        ///< One per frame.
  std::vector<std::vector<uint8_t>> link_inlier;  ///< One per pair of each link.
  std::vector<int> link_inlier_count;             ///< One per link.
  /// Squared error of smooth motion in standard deviations, over all steps.
  double travel_chi_square = 0, turn_chi_square = 0;
};

/// Where the second frame sees what the first one does, in pixels about what it shows, with the
/// Jacobians by the centre and orientation of both (as of MovingCamera).
struct BearingPairError {
  Eigen::Vector2d error_px;
  Eigen::Vector2d by_inverse_depth;
  Matrix26d by_a, by_b;
  bool is_usable = false;  ///< Not more than a right angle off.
};
BearingPairError LineariseBearingPair(const Pinhole& pinhole, const MovingCamera& a,
                                      const MovingCamera& b, const BearingPair& pair,
                                      double inverse_depth);

/// The most probable path: one that is smooth as the noise of motion says, on which frames see
/// landmarks where they are and one another's bearings turned by how the camera turned. What a pair
/// shows may lie anywhere in the scene, so along the line on which it would move by its distance
/// it says little: nearly everything on turning, and of travelling what leads off that line.
/// Gauss-Newton on the dense equations of all frames, Huber loss in all rounds but the last.
/// Nothing where there are no equations to solve, or where they have no finite solution.
std::optional<GapPath> SolveGapPath(const Pinhole& pinhole, const GapPathProblem& problem,
                                    const GapPathOptions& options);

}  // namespace deepuav
