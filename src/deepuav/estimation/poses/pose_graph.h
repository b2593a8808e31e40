#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/sim3.h"

namespace deepuav {

/// A measured relative pose of two nodes; indices into the graph's nodes.
struct PoseGraphEdge {
  int a = 0, b = 0;
  Sim3 a_from_b;
  double weight = 1;  ///< Of the squared error; 0 takes the edge out.
};

/// Poses (of keyframes) and what is known of their relations, as values. In a graph of similarities
/// a node's scale says by how much its neighbourhood has drifted.
struct PoseGraph {
  std::vector<Sim3> node_from_world;
  std::vector<uint8_t> fixed;  ///< One per node. A component without a fixed one keeps its gauge.
  std::vector<PoseGraphEdge> edges;
  /// World units. An error of this length counts as much as one of 1 rad or of a factor e in scale:
  /// about the depth of the scene, as a relative pose is known from pixels.
  double unit_length = 1;
};

struct PoseGraphOptions {
  int max_iterations = 20;
  double min_relative_decrease = 1e-4;  ///< Of the cost in a step: less counts as converged.
  /// Norm of an edge's weighted error from which its cost grows linearly; 0: never.
  double huber_threshold = 0;
  bool fixed_scale = false;  ///< Keeps the nodes' scales: the map is metric.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_iterations", max_iterations, "", "most Levenberg-Marquardt steps", Between(0, 1000));
    visit("min_relative_decrease", min_relative_decrease, "",
          "decrease of the cost below which a step is the last", Below(0, 1));
    visit("huber_threshold", huber_threshold, "",
          "weighted error of an edge from which its cost grows linearly; 0: never",
          Between(0, 1e6));
    visit("fixed_scale", fixed_scale, "", "keep the scale of every node");
  }
};

struct PoseGraphReport {
  int iterations = 0;
  double initial_cost = 0, final_cost = 0;
  bool converged = false;
};

/// The error of an edge, log(measured^-1 * a_from_world * b_from_world^-1), and its derivatives by
/// tangents multiplied from the left to the nodes.
struct PoseGraphResidual {
  Vector7d error;
  Matrix7d by_a, by_b;
};
PoseGraphResidual LinearisePoseGraphEdge(const Sim3& measured_b_from_a, const Sim3& a_from_world,
                                         const Sim3& b_from_world);

/// Levenberg-Marquardt over the nodes on Sim(3) (Strasdat et al. 2010, "Scale drift-aware large
/// scale monocular SLAM"; Mur-Artal 2015, section VII-D), by a sparse Cholesky factorisation. Fixed
/// nodes, and nodes without edges, stay to the bit. Cost and steps depend only on the graph (no
/// threads, fixed order). `stop`, if given, is asked between the steps. Throws Error for sizes that
/// do not fit, indices out of range and values that are not finite.
PoseGraphReport OptimisePoseGraph(PoseGraph* graph, const PoseGraphOptions& options,
                                  const std::function<bool()>& stop = nullptr);

}  // namespace deepuav
