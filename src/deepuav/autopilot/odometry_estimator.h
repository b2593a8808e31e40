#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "deepuav/autopilot/motion_predictor.h"
#include "deepuav/base/ids.h"

namespace deepuav {

/// Where a body is and how it moves, as autopilots are told.
struct Odometry {
  int64_t time_ns = 0;
  SE3 local_from_body;
  Eigen::Vector3d velocity_body = Eigen::Vector3d::Zero();   ///< m/s
  Eigen::Vector3d turn_rate_body = Eigen::Vector3d::Zero();  ///< rad/s
  Matrix6d pose_covariance;      ///< x, y, z, roll, pitch, yaw; NaN where unknown.
  Matrix6d velocity_covariance;  ///< vx, vy, vz and the turn rates; NaN where unknown.
  uint8_t reset_counter = 0;
  int quality = 0;  ///< 1 to 100.
};

/// Roll, pitch and yaw, rad.
Eigen::Vector3d EulerAngles(const Eigen::Quaterniond& rotation);

/// An image that was found in a map.
struct LocatedImage {
  int64_t time_ns = 0;
  MapId map;
  int64_t map_revision = 0;  ///< FrameRecord::map_revision.
  SE3 cam_from_map;
  Matrix6d information = Matrix6d::Zero();  ///< As of BodyPoseOf.
  int landmarks = 0;
};

struct OdometryOptions {
  double max_prediction_s = 0.5;  ///< After the last image that was located.
  /// A change of gauge, a place where a lost camera is found again, and a pose that no motion leads
  /// to, which are off what is expected by less than both, are no jumps.
  double least_jump_m = 0.05, least_jump_rad = 0.01;
  /// From what was predicted, however late the image comes, and of what was told last: more is a
  /// jump.
  double largest_step_m = 0.3, largest_step_rad = 0.3;
  int full_quality_landmarks = 100;  ///< From so many on the quality is 100.
};

/// Makes the body's odometry of images that are located in maps. Thread-compatible.
class OdometryEstimator {
 public:
  OdometryEstimator(const SE3& body_from_cam, const OdometryOptions& options,
                    std::unique_ptr<MotionPredictor> predictor);

  /// `metric`: of the image's map as it is in this revision; nothing: it has no scale.
  void Add(const LocatedImage& image, const std::optional<MetricFromMap>& metric);
  /// Of the body's sensor, on the images' clock.
  void AddInertial(const ImuSample& sample) { predictor_->AddInertial(sample); }
  /// An image was not located.
  void Lost() { is_lost_ = true; }

  enum class Silence { kNone, kNoImage, kLost, kNoScale };
  struct Answer {
    std::optional<Odometry> odometry;
    Silence why = Silence::kNoImage;  ///< There is no odometry.
    std::optional<GeoPoint> origin;   ///< Of the map that the body is in.
  };
  Answer At(int64_t time_ns);

 private:
  /// Of what poses are in: where it changes there may be a jump.
  struct World {
    MapId map;
    int64_t revision = 0;
    MetricFromMap metric;
  };
  /// Whether poses mean another place from this image on.
  bool WorldMoved(const World& world, const LocatedImage& image, const BodyPose& pose) const;
  /// Whether the body is where it cannot have come by moving, as far as that is known.
  bool IsElsewhere(const LocatedImage& image, const BodyPose& pose) const;
  /// Whether what was told last would now be told far from there: an image that comes late changes
  /// the velocity, too, which leads on from it.
  bool MovesWhatWasTold() const;
  Odometry Describe(const BodyMotion& motion, int64_t time_ns) const;
  bool IsOld(int64_t time_ns) const;

  const SE3 body_from_cam_;
  const OdometryOptions options_;
  std::unique_ptr<MotionPredictor> predictor_;
  std::optional<World> world_;                   ///< Of the last image that was located with scale.
  std::optional<std::pair<int64_t, SE3>> told_;  ///< When and where the body was said to be last.
  int64_t time_ns_ = 0;                          ///< Its time...
  int landmarks_ = 0;                            ///< ...and what it saw.
  bool has_scale_ = false, is_lost_ = false, was_located_ = false;
  uint8_t reset_counter_ = 0;
};

}  // namespace deepuav
