// How far a map's observations lie from the epipolar lines of the truth, as the network detected
// them and as patches measured them:
//
//   observation_error MAP.deepuav TRUTH [FIRST_KEYFRAMES_APART LAST_KEYFRAMES_APART]
//
// For every landmark, pairs of observations so many of its observations apart (1 to 3); prints
// count, median and 90th percentile in pixels, of all pairs and of those that patches measured, and
// the median of the squared error in standard deviations, which is 0.45 where noise is as stated.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/evaluation/measures/truth.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/matching/epipolar.h"

namespace deepuav {
namespace {

constexpr double kMaxTimeDifferenceS = 0.005;

class TruePoses {
 public:
  explicit TruePoses(const Trajectory& truth) {
    for (const TimedPose& pose : truth) poses_.emplace(pose.time.nanoseconds, pose.world_from_cam);
  }

  const SE3* At(Timestamp time) const {
    const auto bound = static_cast<int64_t>(kMaxTimeDifferenceS * 1e9);
    const auto found = poses_.lower_bound(time.nanoseconds - bound);
    if (found == poses_.end() || found->first > time.nanoseconds + bound) return nullptr;
    return &found->second;
  }

 private:
  std::map<int64_t, SE3> poses_;
};

struct Errors {
  std::vector<double> px, squared_sigmas;

  void Add(const Eigen::Vector3d& line, const Eigen::Vector2d& px_b, const PixelNoise& noise) {
    const double norm = line.head<2>().norm();
    if (!(norm > 0)) return;
    const Eigen::Vector2d normal = line.head<2>() / norm;
    const double error = (normal.dot(px_b) + line.z() / norm);
    px.push_back(std::abs(error));
    squared_sigmas.push_back(error * error / normal.dot(noise.Covariance() * normal));
  }
};

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

void Print(const char* name, const Errors& errors) {
  std::cout << fmt::format("{:<28} {:>8} {:>8.3f} {:>8.3f} {:>8.2f}\n", name, errors.px.size(),
                           Quantile(errors.px, 0.5), Quantile(errors.px, 0.9),
                           Quantile(errors.squared_sigmas, 0.5));
}

int Run(int argc, char** argv) {
  if (argc != 3 && argc != 5) {
    std::cerr << "usage: observation_error MAP.deepuav TRUTH [FIRST_APART LAST_APART]\n";
    return 2;
  }
  const size_t first = argc == 5 ? std::strtoul(argv[3], nullptr, 10) : 1;
  const size_t last = argc == 5 ? std::strtoul(argv[4], nullptr, 10) : 3;
  const LoadedAtlas loaded = ReadMapFile(argv[1]);
  const Truth truth = LoadTruth(argv[2]);
  const TruePoses poses(truth.trajectory);
  Errors detected, detected_of_measured, measured;
  for (const MapId id : loaded.atlas.Remaining()) {
    const Map& map = loaded.atlas.At(id);
    map.landmarks().ForEach([&](const Landmark& landmark) {
      for (size_t i = 0; i < landmark.observations.size(); ++i) {
        for (size_t j = i + first; j <= i + last && j < landmark.observations.size(); ++j) {
          const Observation& a = landmark.observations[i];
          const Observation& b = landmark.observations[j];
          const Keyframe &view_a = map.At(a.keyframe), &view_b = map.At(b.keyframe);
          const SE3* pose_a = poses.At(view_a.frame.time);
          const SE3* pose_b = poses.At(view_b.frame.time);
          if (!pose_a || !pose_b) continue;
          const Eigen::Matrix3d fundamental =
              FundamentalFromPose(loaded.camera.pinhole, pose_b->Inverse() * *pose_a);
          const Keypoint& raw_a = view_a.features().keypoints[static_cast<size_t>(a.keypoint)];
          const Keypoint& raw_b = view_b.features().keypoints[static_cast<size_t>(b.keypoint)];
          const auto line = [&](const Eigen::Vector2f& px) -> Eigen::Vector3d {
            return fundamental * px.cast<double>().homogeneous();
          };
          const PixelNoise of_both = PixelNoise(raw_a.sigma_px) + PixelNoise(raw_b.sigma_px);
          detected.Add(line(raw_a.px), raw_b.px.cast<double>(), of_both);
          if (!a.measured.by_patch || !b.measured.by_patch) continue;
          detected_of_measured.Add(line(raw_a.px), raw_b.px.cast<double>(), of_both);
          measured.Add(line(a.measured.px), b.measured.px.cast<double>(),
                       a.measured.noise + b.measured.noise);
        }
      }
    });
  }
  std::cout << fmt::format("{:<28} {:>8} {:>8} {:>8} {:>8}\n", "epipolar error, px", "pairs",
                           "median", "p90", "chi2 p50");
  Print("detected, all", detected);
  Print("detected, of the measured", detected_of_measured);
  Print("measured by patches", measured);
  return 0;
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  return deepuav::RunBench("observation_error", [&] { return deepuav::Run(argc, argv); });
}
