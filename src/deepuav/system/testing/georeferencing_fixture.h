#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/sensors/georeferencing.h"
#include "support/synthetic_visits.h"

namespace deepuav {

inline const GeoPoint kOrigin{47.4, 8.5, 500};
inline const Eigen::Vector3d kAntenna(0.2, -0.1, 0);
/// What the camera makes of the flight: another place, another scale.
inline const Sim3 kMapFromLocal(0.1, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
inline constexpr int kRows = 4, kColumns = 12;
inline constexpr double kHeight = 12, kSpacing = 3;

/// Rows flown to and fro over ground.
inline std::vector<SE3> Flight() {
  std::vector<SE3> poses;
  for (int row = 0; row < kRows; ++row) {
    for (int k = 0; k < kColumns; ++k) {
      const int column = row % 2 == 0 ? k : kColumns - 1 - k;
      poses.push_back(LookDown({kSpacing * column, kSpacing * row - 5, kHeight}, 0));
    }
  }
  return poses;
}

/// A map whose scale grows along the flight, records of its keyframes, and what sensors measured.
class GeoreferencingTest : public testing::Test {
 protected:
  GeoreferencingTest() : world_(StripOfGround(1, 1200)), made_(world_, 2), flight_(Flight()) {
    made_.AddMap();
    visit_ = made_.Add(MapId{0}, flight_, kMapFromLocal, {0.3, 0.3, 0, 0});
    Random random(3);
    for (size_t i = 0; i < flight_.size(); ++i) {
      const Keyframe& keyframe = map().At(visit_.keyframes[i]);
      FrameRecord record;
      record.id = keyframe.frame.id;
      record.time = keyframe.frame.time;
      record.map = MapId{0};
      record.pose = {keyframe.id, SE3(), keyframe.scale};
      records_.push_back(record);
      AddFix(record.time, flight_[i].Inverse() * kAntenna, &random);
    }
    streams_.gnss.antenna_cam_m = kAntenna;
    options_.gnss.correlation_s = 0;
    options_.barometer.step_s = 0.05;  // The keyframes are so close in time.
    options_.barometer.window_s = 0.01;
  }

  Map& map() { return made_.atlas.At(MapId{0}); }

  void AddFix(Timestamp time, const Eigen::Vector3d& position_m, Random* random,
              double sigma_m = 0.3) {
    const Eigen::Vector3d noise(random->Gaussian(sigma_m), random->Gaussian(sigma_m),
                                random->Gaussian(sigma_m));
    const GeoPoint point = GeoFromLocal(kOrigin, position_m + noise);
    streams_.gnss.fixes.push_back({time, point.latitude_deg, point.longitude_deg, point.altitude_m,
                                   Eigen::Vector3d::Constant(sigma_m)});
    streams_.barometer.samples.push_back({time, 0, 20 + (position_m).z()});
  }

  /// The map bends: later parts are larger, as a camera alone may see it.
  void Drift(double growth) {
    const double count = static_cast<double>(flight_.size());
    const auto grown = [&](const Eigen::Vector3d& position) {
      const Eigen::Vector3d local = kMapFromLocal.Inverse() * position;
      const double factor = 1 + growth * (local.y() + 5) / count;
      return kMapFromLocal * Eigen::Vector3d(factor * local);
    };
    for (const KeyframeId id : visit_.keyframes) {
      const SE3 pose = map().At(id).cam_from_world;
      map().SetPose(id,
                    SE3(pose.rotation(), -(pose.rotation() * grown(pose.InverseTranslation()))));
    }
    std::vector<LandmarkId> landmarks;
    map().landmarks().ForEach([&](const Landmark& l) { landmarks.push_back(l.id); });
    for (LandmarkId id : landmarks) map().SetPosition(id, grown(map().At(id).position_world));
  }

  GeoreferenceReport Apply() {
    Mapper mapper(camera(), {}, &made_.atlas, nullptr);
    Georeferencing georeferencing(streams_, options_, priors_, &mapper, &made_.atlas);
    Pinhole pinhole = world_.world().pinhole;
    return georeferencing.Apply(MapId{0}, records_, &pinhole, false, nullptr);
  }

  Camera camera() {
    Camera camera;
    camera.pinhole = world_.world().pinhole;
    camera.width = 752;
    camera.height = 480;
    return camera;
  }

  /// Root mean squared distance of the keyframes from the truth, about the truth's origin.
  double Error(const GeoPoint& origin) {
    double squares = 0;
    for (size_t i = 0; i < flight_.size(); ++i) {
      const Eigen::Vector3d found =
          LocalFromLocal(kOrigin, origin) *
          map().At(visit_.keyframes[i]).cam_from_world.InverseTranslation();
      squares += (found - flight_[i].InverseTranslation()).squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(flight_.size()));
  }

  const FeatureWorld world_;
  SyntheticVisits made_;
  std::vector<SE3> flight_;
  Visit visit_;
  std::vector<FrameRecord> records_;
  SensorStreams streams_;
  SensorUseOptions options_;
  MetricPriors priors_;
};

}  // namespace deepuav
