#include "deepuav/estimation/poses/pose_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/estimation/solvers/block_values.h"
#include "deepuav/estimation/solvers/levenberg_damping.h"

namespace deepuav {
namespace {

constexpr int kSize = 7;
constexpr int kScale = 6;  // Of a tangent's parameters.
/// The slow modes of a long chain of nodes have curvatures far below the diagonal, which a common
/// damping would freeze.
constexpr double kInitialDamping = 1e-10;
constexpr double kMinDamping = 1e-12;
constexpr double kMaxDamping = 1e6;
/// A cost is as good as none below this share of the initial one.
constexpr double kNegligibleCost = 1e-6;
/// Below this a diagonal element is damped as if it were this: a parameter that nothing sees must
/// not move.
constexpr double kMinDiagonal = 1e-6;

using Nodes = std::vector<Sim3>;

/// An edge that moves a node.
struct ActiveEdge {
  int a, b;            // Nodes.
  int free_a, free_b;  // Among the nodes that move; -1 for a fixed one.
  Sim3 measured_b_from_a;
  double weight;
};

/// Which nodes move: those that are not fixed and have an edge with weight.
struct ActiveGraph {
  explicit ActiveGraph(const PoseGraph& graph) {
    std::vector<int> free_of_node(graph.node_from_world.size(), -1);
    for (const PoseGraphEdge& edge : graph.edges) {
      if (edge.weight == 0) continue;
      for (const int node : {edge.a, edge.b}) free_of_node[node] = graph.fixed[node] ? -1 : 0;
    }
    for (size_t node = 0; node < free_of_node.size(); ++node) {
      if (free_of_node[node] < 0) continue;
      free_of_node[node] = static_cast<int>(node_of_free.size());
      node_of_free.push_back(static_cast<int>(node));
    }
    for (const PoseGraphEdge& edge : graph.edges) {
      const int free_a = free_of_node[edge.a], free_b = free_of_node[edge.b];
      if (edge.weight == 0 || (free_a < 0 && free_b < 0)) continue;
      edges.push_back({edge.a, edge.b, free_a, free_b, edge.a_from_b.Inverse(), edge.weight});
    }
  }

  BlockPattern Pattern() const {
    std::vector<std::pair<int, int>> pairs;
    pairs.reserve(edges.size());
    for (const ActiveEdge& edge : edges) {
      if (edge.free_a < 0 || edge.free_b < 0) continue;
      pairs.emplace_back(std::max(edge.free_a, edge.free_b), std::min(edge.free_a, edge.free_b));
    }
    return BlockPattern::OfPairs(static_cast<int>(node_of_free.size()), std::move(pairs));
  }

  std::vector<int> node_of_free;
  std::vector<ActiveEdge> edges;
};

/// What makes a number of an edge's error.
struct Metric {
  Vector7d scaling;
  HuberLoss loss;

  Metric(double unit_length, const PoseGraphOptions& options)
      : loss{options.huber_threshold > 0 ? options.huber_threshold * options.huber_threshold
                                         : std::numeric_limits<double>::max()} {
    scaling.setOnes();
    scaling.head<3>().setConstant(1 / unit_length);
    if (options.fixed_scale) scaling[kScale] = 0;
  }
};

double Cost(const ActiveGraph& graph, const Nodes& nodes, const Metric& metric) {
  double cost = 0;
  for (const ActiveEdge& edge : graph.edges) {
    const Vector7d error = (edge.measured_b_from_a * nodes[edge.a] * nodes[edge.b].Inverse()).Log();
    cost += metric.loss.Cost(edge.weight * error.cwiseProduct(metric.scaling).squaredNorm());
  }
  return cost;
}

/// The normal equations of the nodes that move, and their damped solution.
class PoseGraphSystem {
 public:
  PoseGraphSystem(const ActiveGraph& graph, const Metric& metric, bool fixed_scale)
      : graph_(graph),
        metric_(metric),
        parameters_(fixed_scale ? kScale : kSize),
        hessian_(graph.Pattern()),
        factor_(hessian_.pattern()) {
    gradient_.resize(kSize * columns());
  }

  void Linearise(const Nodes& nodes) {
    hessian_.Clear();
    gradient_.setZero();
    for (const ActiveEdge& edge : graph_.edges) Accumulate(edge, nodes);
    diagonal_.resize(gradient_.size());
    for (int i = 0; i < columns(); ++i) {
      diagonal_.segment<kSize>(kSize * i) = hessian_.Column(i).topRows<kSize>().diagonal();
    }
  }

  /// Solves (H + damping diag(H)) step = -gradient. False where the damped system is not positive
  /// definite.
  bool Solve(double damping) {
    const auto damp = diagonal_.cwiseMax(kMinDiagonal);
    for (int i = 0; i < columns(); ++i) {
      hessian_.Column(i).topRows<kSize>().diagonal() =
          diagonal_.segment<kSize>(kSize * i) + damping * damp.segment<kSize>(kSize * i);
    }
    if (!factor_.Factorise(hessian_.data())) return false;
    step_ = -gradient_;
    factor_.SolveInPlace(&step_);
    predicted_decrease_ = damping * damp.dot(step_.cwiseAbs2()) - gradient_.dot(step_);
    return step_.allFinite();
  }

  Vector7d step(int free) const { return step_.segment<kSize>(kSize * free); }
  /// By how much the quadratic model of the cost falls.
  double predicted_decrease() const { return predicted_decrease_; }

 private:
  int columns() const { return hessian_.pattern().columns(); }

  void Accumulate(const ActiveEdge& edge, const Nodes& nodes) {
    PoseGraphResidual residual =
        LinearisePoseGraphEdge(edge.measured_b_from_a, nodes[edge.a], nodes[edge.b]);
    const Vector7d error = residual.error.cwiseProduct(metric_.scaling);
    for (Matrix7d* jacobian : {&residual.by_a, &residual.by_b}) {
      *jacobian = metric_.scaling.asDiagonal() * *jacobian;
      jacobian->rightCols(kSize - parameters_).setZero();
    }
    const double weight = edge.weight * metric_.loss.Weight(edge.weight * error.squaredNorm());
    const Matrix7d weighted_a = weight * residual.by_a.transpose();
    const Matrix7d weighted_b = weight * residual.by_b.transpose();
    if (edge.free_a >= 0) {
      hessian_.At(edge.free_a, edge.free_a) += weighted_a.lazyProduct(residual.by_a);
      gradient_.segment<kSize>(kSize * edge.free_a) += weighted_a * error;
    }
    if (edge.free_b >= 0) {
      hessian_.At(edge.free_b, edge.free_b) += weighted_b.lazyProduct(residual.by_b);
      gradient_.segment<kSize>(kSize * edge.free_b) += weighted_b * error;
    }
    if (edge.free_a < 0 || edge.free_b < 0) return;
    if (edge.free_a > edge.free_b) {
      hessian_.At(edge.free_a, edge.free_b) += weighted_a.lazyProduct(residual.by_b);
    } else {
      hessian_.At(edge.free_b, edge.free_a) += weighted_b.lazyProduct(residual.by_a);
    }
  }

  const ActiveGraph& graph_;
  const Metric& metric_;
  const int parameters_;  ///< Of each node that move, the first ones of its tangent.
  BlockValues<kSize> hessian_;
  BlockCholesky<kSize> factor_;
  Eigen::VectorXd gradient_, diagonal_, step_;
  double predicted_decrease_ = 0;
};

void Minimise(const ActiveGraph& graph, const Metric& metric, const PoseGraphOptions& options,
              const std::function<bool()>& stop, Nodes* nodes, PoseGraphReport* report) {
  PoseGraphSystem system(graph, metric, options.fixed_scale);
  LevenbergDamping damping(kInitialDamping, kMinDamping, kMaxDamping);
  Nodes candidate = *nodes;
  bool linearised = false;
  while (report->iterations < options.max_iterations && !report->converged &&
         !damping.Exhausted()) {
    if (stop && stop()) return;
    ++report->iterations;
    if (!linearised) system.Linearise(*nodes);
    linearised = true;
    if (!system.Solve(damping.value())) {
      damping.Reject();
      continue;
    }
    for (size_t i = 0; i < graph.node_of_free.size(); ++i) {
      const int node = graph.node_of_free[i];
      candidate[node] = Sim3::Exp(system.step(static_cast<int>(i))) * (*nodes)[node];
    }
    const double cost = Cost(graph, candidate, metric);
    const double decrease = report->final_cost - cost;
    const double enough = options.min_relative_decrease *
                          std::max(report->final_cost, kNegligibleCost * report->initial_cost);
    if (!(decrease >= 0)) {  // Also where the cost is not a number.
      damping.Reject();
      report->converged = system.predicted_decrease() <= enough;
      continue;
    }
    report->converged = decrease <= enough;
    damping.Accept(system.predicted_decrease() > 0 ? decrease / system.predicted_decrease() : 1);
    std::swap(*nodes, candidate);
    report->final_cost = cost;
    linearised = false;
  }
}

bool Finite(const Sim3& transform) {
  return transform.scale() > 0 && std::isfinite(transform.scale()) &&
         transform.translation().allFinite() && transform.rotation().coeffs().allFinite();
}

void CheckPoseGraph(const PoseGraph& graph) {
  const size_t nodes = graph.node_from_world.size();
  if (graph.fixed.size() != nodes) {
    throw Error("pose graph: fixed has {} entries, expected one for each of {} nodes",
                graph.fixed.size(), nodes);
  }
  if (!(graph.unit_length > 0 && std::isfinite(graph.unit_length))) {
    throw Error("pose graph: unit_length is {}, expected above 0", graph.unit_length);
  }
  for (size_t i = 0; i < nodes; ++i) {
    if (!Finite(graph.node_from_world[i])) throw Error("pose graph: node {} is not finite", i);
  }
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    const PoseGraphEdge& edge = graph.edges[i];
    const int count = static_cast<int>(nodes);
    if (edge.a < 0 || edge.a >= count || edge.b < 0 || edge.b >= count) {
      throw Error("pose graph: edge {} joins nodes {} and {}, expected below {}", i, edge.a, edge.b,
                  nodes);
    }
    if (edge.a == edge.b) throw Error("pose graph: edge {} joins node {} with itself", i, edge.a);
    if (!Finite(edge.a_from_b) || !(edge.weight >= 0 && std::isfinite(edge.weight))) {
      throw Error("pose graph: edge {} has weight {} or a pose that is not finite", i, edge.weight);
    }
  }
}

}  // namespace

PoseGraphResidual LinearisePoseGraphEdge(const Sim3& measured_b_from_a, const Sim3& a_from_world,
                                         const Sim3& b_from_world) {
  PoseGraphResidual residual;
  residual.error = (measured_b_from_a * a_from_world * b_from_world.Inverse()).Log();
  residual.by_a = Sim3LeftJacobianInverse(residual.error).lazyProduct(measured_b_from_a.Adjoint());
  residual.by_b = -Sim3LeftJacobianInverse(-residual.error);
  return residual;
}

void PoseGraphOptions::Check() const { CheckOptions("", *this); }

PoseGraphReport OptimisePoseGraph(PoseGraph* graph, const PoseGraphOptions& options,
                                  const std::function<bool()>& stop) {
  options.Check();
  CheckPoseGraph(*graph);
  const ActiveGraph active(*graph);
  const Metric metric(graph->unit_length, options);
  PoseGraphReport report;
  report.initial_cost = report.final_cost = Cost(active, graph->node_from_world, metric);
  if (active.edges.empty()) {
    report.converged = true;
    return report;
  }
  Minimise(active, metric, options, stop, &graph->node_from_world, &report);
  return report;
}

}  // namespace deepuav
