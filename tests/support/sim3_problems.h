#pragma once

#include <cmath>
#include <vector>

#include "deepuav/estimation/poses/pose_graph.h"
#include "deepuav/estimation/poses/sim3_optimisation.h"
#include "support/synthetic_world.h"

namespace deepuav {

struct SyntheticSim3 {
  Pinhole pinhole;
  Sim3 a_from_b;  ///< The truth.
  std::vector<Sim3Correspondence> correspondences;
  std::vector<uint8_t> outlier;  ///< One per correspondence.
};

struct SyntheticSim3Noise {
  double sigma_px = 0;
  double relative_depth = 0;  ///< Standard deviation, of both maps' landmarks along the rays.
  double outlier_ratio = 0;
};

/// Landmarks that two cameras 1 m and 0.2 rad apart see, as two maps know them, b's with its unit
/// `scale` times a's. An outlier pairs a landmark of a with another one of b.
inline SyntheticSim3 MakeSim3Problem(int count, double scale, const SyntheticSim3Noise& noise,
                                     Random* random) {
  SyntheticWorld world;
  const SE3 a_from_world = Perturbed(SE3(), 0.3, 0.1, random);
  const SE3 rigid = Perturbed(SE3(), 1, 0.2, random);
  const SE3 b_from_world = rigid.Inverse() * a_from_world;
  SyntheticSim3 problem;
  problem.pinhole = world.pinhole;
  problem.a_from_b = Sim3(rigid, scale);
  const auto pixel = [&](const Eigen::Vector3d& point) {
    const Eigen::Vector2d shift(random->Gaussian(noise.sigma_px), random->Gaussian(noise.sigma_px));
    return Eigen::Vector2d(world.pinhole.Project(point) + shift);
  };
  while (static_cast<int>(problem.correspondences.size()) < count) {
    const Eigen::Vector3d landmark = LandmarksInBox(1, {-6, -4, 4}, {6, 4, 15}, random)[0];
    Sim3Correspondence c;
    c.point_a = a_from_world * landmark;
    c.point_b = (b_from_world * landmark) / scale;
    if (c.point_a.z() < 1 || c.point_b.z() < 1 / scale) continue;
    c.px_a = pixel(c.point_a);
    c.px_b = pixel(c.point_b);
    c.point_a *= 1 + random->Gaussian(noise.relative_depth);
    c.point_b *= 1 + random->Gaussian(noise.relative_depth);
    problem.correspondences.push_back(c);
  }
  const std::vector<Sim3Correspondence> right = problem.correspondences;
  for (int i = 0; i < count; ++i) {
    problem.outlier.push_back(random->Uniform(0, 1) < noise.outlier_ratio);
    if (!problem.outlier.back()) continue;
    const Sim3Correspondence& other = right[(i + 1 + random->Index(count - 1)) % count];
    problem.correspondences[i].point_b = other.point_b;
    problem.correspondences[i].px_b = other.px_b;
  }
  return problem;
}

struct SyntheticLoop {
  std::vector<SE3> truth;  ///< node_from_world
  PoseGraph graph;         ///< As mapped with drift; the last edge is the loop's.
};

/// `laps` laps of `count` keyframes in all on a circle of radius 10 m, mapped with a drift of
/// heading and of the logarithm of scale, both as totals over the path. Each keyframe has an edge
/// with its `neighbours` predecessors, as the map has them, and the last one a true edge with the
/// first, which outweighs the chain of the others. `sigma_rad`: noise of each step's rotation, and
/// of its translation over the depth.
inline SyntheticLoop MakeDriftingLoop(int count, int laps, int neighbours, double heading_drift,
                                      double log_scale_drift, Random* random,
                                      double sigma_rad = 0) {
  constexpr double kRadius = 10;  // Also the depth of what the cameras see.
  SyntheticLoop loop;
  loop.graph.unit_length = kRadius;
  loop.truth = OrbitPath(count, {0, 0, 0}, kRadius, 2, laps * 2 * M_PI);
  std::vector<SE3> mapped{loop.truth[0]};
  std::vector<double> scale{1};
  for (int i = 1; i < count; ++i) {
    const SE3 step = loop.truth[i] * loop.truth[i - 1].Inverse();
    Vector6d error;
    for (int k = 0; k < 6; ++k)
      error[k] = random->Gaussian(k < 3 ? kRadius * sigma_rad : sigma_rad);
    error[4] += heading_drift / count;
    scale.push_back(scale.back() * std::exp(log_scale_drift / count));
    const SE3 drifted(step.rotation(), scale.back() * step.translation());
    mapped.push_back(SE3::Exp(error) * drifted * mapped.back());
  }
  for (const SE3& pose : mapped) loop.graph.node_from_world.emplace_back(pose);
  loop.graph.fixed.assign(count, 0);
  loop.graph.fixed[0] = 1;
  for (int i = 1; i < count; ++i) {
    for (int k = std::max(0, i - neighbours); k < i; ++k) {
      loop.graph.edges.push_back({i, k, Sim3(mapped[i] * mapped[k].Inverse()), 1});
    }
  }
  const SE3 closure = loop.truth.back() * loop.truth[0].Inverse();
  const Sim3 in_map_unit(scale.back(), closure.rotation(), scale.back() * closure.translation());
  loop.graph.edges.push_back({count - 1, 0, in_map_unit, 100});
  return loop;
}

/// Root mean square distance of the nodes' centres from the truth.
inline double LoopError(const SyntheticLoop& loop) {
  double sum = 0;
  for (size_t i = 0; i < loop.truth.size(); ++i) {
    const Eigen::Vector3d centre = loop.graph.node_from_world[i].Inverse().translation();
    sum += (centre - loop.truth[i].InverseTranslation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(loop.truth.size()));
}

}  // namespace deepuav
