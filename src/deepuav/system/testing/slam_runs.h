#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/slam.h"
#include "support/path_error.h"
#include "support/synthetic_flight.h"

namespace deepuav {

inline constexpr FeatureNoise kNoise{0.4, 0.3, 0, 20};

inline FeatureWorld BoxWorld(uint64_t seed = 1) {
  Random random(seed);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(900, {-10, -6, 7}, {24, 6, 18}, &random);
  return FeatureWorld(geometry, seed + 1);
}

/// Sideways along the box, weaving.
inline std::vector<SE3> WeavingPath(int count) {
  std::vector<SE3> path;
  for (int i = 0; i < count; ++i) {
    const double x = 0.15 * i;
    path.push_back(SE3(RotationExp({0.02 * std::sin(0.4 * x), 0.05 * std::sin(0.3 * x), 0}),
                       Eigen::Vector3d(-x, 0.3 * std::sin(0.5 * x), 0.3 * std::cos(0.4 * x))));
  }
  return path;
}

/// A run and the system it left.
struct Outcome {
  std::unique_ptr<Slam> slam;
  SlamResult result;
};

inline Outcome Fly(const SyntheticFlight& flight, Schedule schedule = Schedule::kSequential,
                   const SystemOptions& options = {}, const Slam::Progress& progress = nullptr,
                   const std::function<bool()>& stop = nullptr, int throws_at = -1,
                   const SensorStreams& sensors = {}) {
  PreparedFeatures extractor(flight.features);
  NearestNeighbourMatcher matcher({});
  NumberedImages images(flight.size(), flight.frame_interval_s, throws_at);
  Outcome run;
  run.slam = std::make_unique<Slam>(flight.camera, options, Perception{&extractor, &matcher});
  run.slam->UseSensors(sensors);
  run.result = run.slam->Run(&images, schedule, progress, stop);
  return run;
}

inline int Located(const SlamResult& result) {
  int located = 0;
  for (const FrameRecord& record : result.frames) located += record.located();
  return located;
}

/// Of the frames in one map, after alignment with the truth; metres of the world.
inline double PathError(const SlamResult& result, const SyntheticFlight& flight, MapId map = {0}) {
  std::vector<Eigen::Vector3d> estimate, truth;
  for (const FrameRecord& record : result.frames) {
    if (!record.located() || record.map != map) continue;
    estimate.push_back(record.cam_from_world.InverseTranslation());
    truth.push_back(
        flight.cam_from_world[static_cast<size_t>(record.id.value)].InverseTranslation());
  }
  return RmseAfterAlignment(estimate, truth);
}

/// All bits of what a run found.
inline std::string Bytes(const SlamResult& result) {
  std::string bytes;
  const auto add = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (const FrameRecord& record : result.frames) {
    add(record.id.value);
    add(record.map.value);
    add(record.pose.keyframe.value);
    add(record.state);
    for (int i = 0; i < 4; ++i) add(record.cam_from_world.rotation().coeffs()[i]);
    for (int i = 0; i < 3; ++i) add(record.cam_from_world.translation()[i]);
    add(record.seen.size());
    bytes += record.reason;
  }
  return bytes;
}

}  // namespace deepuav
