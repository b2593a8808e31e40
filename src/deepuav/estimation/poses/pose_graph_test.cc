#include "deepuav/estimation/poses/pose_graph.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/base/error.h"
#include "support/numeric_jacobian.h"
#include "support/sim3_problems.h"

namespace deepuav {
namespace {

Sim3 RandomSim3(double sigma, Random* random) {
  Vector7d tangent;
  for (int i = 0; i < 7; ++i) tangent[i] = random->Gaussian(sigma);
  return Sim3::Exp(tangent);
}

double Difference(const Sim3& a, const Sim3& b) { return (a * b.Inverse()).Log().norm(); }

bool SameBits(const Sim3& a, const Sim3& b) {
  return a.scale() == b.scale() && a.translation() == b.translation() &&
         a.rotation().coeffs() == b.rotation().coeffs();
}

/// Nodes anywhere, each joined with its neighbours by their true relation, then disturbed.
struct RandomGraph {
  RandomGraph(int nodes, int neighbours, double disturbance, uint64_t seed) {
    Random random(seed);
    for (int i = 0; i < nodes; ++i) truth.push_back(RandomSim3(0.7, &random));
    for (int i = 0; i < nodes; ++i) {
      for (int k = 1; k <= neighbours; ++k) {
        const int other = (i + k) % nodes;
        graph.edges.push_back({i, other, truth[i] * truth[other].Inverse(), 1});
      }
    }
    graph.fixed.assign(nodes, 0);
    graph.fixed[0] = 1;
    for (const Sim3& node : truth) {
      graph.node_from_world.push_back(RandomSim3(disturbance, &random) * node);
    }
    graph.node_from_world[0] = truth[0];
  }

  std::vector<Sim3> truth;
  PoseGraph graph;
};

TEST(PoseGraphEdge, JacobiansEqualCentralDifferences) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Sim3 a = RandomSim3(0.7, &random), b = RandomSim3(0.7, &random);
    const Sim3 measured_b_from_a = RandomSim3(0.2, &random) * b * a.Inverse();
    const PoseGraphResidual residual = LinearisePoseGraphEdge(measured_b_from_a, a, b);
    const auto by_a = [&](const Eigen::VectorXd& tangent) -> Eigen::VectorXd {
      return LinearisePoseGraphEdge(measured_b_from_a, Sim3::Exp(Vector7d(tangent)) * a, b).error;
    };
    const auto by_b = [&](const Eigen::VectorXd& tangent) -> Eigen::VectorXd {
      return LinearisePoseGraphEdge(measured_b_from_a, a, Sim3::Exp(Vector7d(tangent)) * b).error;
    };
    EXPECT_LT((residual.by_a - NumericJacobian(by_a, 7)).norm(), 1e-6);
    EXPECT_LT((residual.by_b - NumericJacobian(by_b, 7)).norm(), 1e-6);
  }
}

TEST(OptimisePoseGraph, FindsTheExactNodesFromTrueEdges) {
  RandomGraph problem(30, 3, 0.2, 2);
  PoseGraphOptions options;
  options.min_relative_decrease = 0;
  const PoseGraphReport report = OptimisePoseGraph(&problem.graph, options);
  EXPECT_GT(report.initial_cost, 1);
  EXPECT_LT(report.final_cost, 1e-18);
  for (size_t i = 0; i < problem.truth.size(); ++i) {
    EXPECT_LT(Difference(problem.graph.node_from_world[i], problem.truth[i]), 1e-8) << i;
  }
}

TEST(OptimisePoseGraph, ConvergesInFewSteps) {
  RandomGraph problem(100, 4, 0.1, 3);
  const PoseGraphReport report = OptimisePoseGraph(&problem.graph, {});
  EXPECT_TRUE(report.converged);
  EXPECT_LE(report.iterations, 8);
}

TEST(OptimisePoseGraph, PullsOutTheDriftOfHeadingAndScale) {
  Random random(4);
  SyntheticLoop loop = MakeDriftingLoop(200, 1, 5, 0.3, std::log(1.5), &random);
  const double before = LoopError(loop);
  const PoseGraphReport report = OptimisePoseGraph(&loop.graph, {});
  const double after = LoopError(loop);
  EXPECT_TRUE(report.converged);
  EXPECT_GT(before, 1.5);  // Of a circle of 10 m radius.
  EXPECT_LT(after, 0.05 * before);
  // The last node's neighbourhood was mapped 1.5 times too large.
  EXPECT_NEAR(loop.graph.node_from_world.back().scale(), 1.5, 0.01);
}

TEST(OptimisePoseGraph, LeavesLittleMoreThanTheNoise) {
  Random random(5), without_drift(5);
  SyntheticLoop loop = MakeDriftingLoop(200, 1, 5, 0.3, std::log(1.5), &random, 0.001);
  SyntheticLoop noise_only = MakeDriftingLoop(200, 1, 5, 0, 0, &without_drift, 0.001);
  const double before = LoopError(loop);
  OptimisePoseGraph(&loop.graph, {});
  OptimisePoseGraph(&noise_only.graph, {});
  EXPECT_LT(LoopError(loop), 2 * LoopError(noise_only));
  EXPECT_LT(LoopError(loop), 0.1 * before);
}

TEST(OptimisePoseGraph, OfFixedScaleKeepsEveryScale) {
  Random random(6);
  SyntheticLoop loop = MakeDriftingLoop(200, 1, 5, 0.3, 0, &random);
  const double before = LoopError(loop);
  PoseGraphOptions options;
  options.fixed_scale = true;
  OptimisePoseGraph(&loop.graph, options);
  EXPECT_LT(LoopError(loop), 0.1 * before);
  for (const Sim3& node : loop.graph.node_from_world) EXPECT_EQ(node.scale(), 1);
}

TEST(OptimisePoseGraph, TheUnitOfLengthCancels) {
  Random random(7), again(7);
  SyntheticLoop loop = MakeDriftingLoop(60, 1, 3, 0.3, 0.3, &random, 0.01);
  SyntheticLoop large = MakeDriftingLoop(60, 1, 3, 0.3, 0.3, &again, 0.01);
  const auto enlarge = [](Sim3* transform) {
    *transform = Sim3(transform->scale(), transform->rotation(), 100 * transform->translation());
  };
  for (Sim3& node : large.graph.node_from_world) enlarge(&node);
  for (PoseGraphEdge& edge : large.graph.edges) enlarge(&edge.a_from_b);
  large.graph.unit_length *= 100;
  const PoseGraphReport a = OptimisePoseGraph(&loop.graph, {});
  const PoseGraphReport b = OptimisePoseGraph(&large.graph, {});
  EXPECT_NEAR(a.final_cost, b.final_cost, 1e-6 * a.final_cost);
  EXPECT_NEAR(
      100 * LoopError(loop),
      [&] {
        SyntheticLoop small = large;
        for (Sim3& node : small.graph.node_from_world) {
          node = Sim3(node.scale(), node.rotation(), 0.01 * node.translation());
        }
        return 100 * LoopError(small);
      }(),
      1e-4);
}

TEST(OptimisePoseGraph, FixedNodesAndNodesWithoutEdgesStayToTheBit) {
  RandomGraph problem(30, 3, 0.2, 8);
  problem.graph.fixed[10] = problem.graph.fixed[11] = 1;  // And the edge between them.
  problem.graph.node_from_world.push_back(problem.truth[3]);
  problem.graph.fixed.push_back(0);
  problem.graph.edges.push_back({30, 4, Sim3(), 0});
  const std::vector<Sim3> before = problem.graph.node_from_world;
  OptimisePoseGraph(&problem.graph, {});
  for (int i : {0, 10, 11, 30}) EXPECT_TRUE(SameBits(problem.graph.node_from_world[i], before[i]));
  EXPECT_FALSE(SameBits(problem.graph.node_from_world[12], before[12]));
}

TEST(OptimisePoseGraph, ComponentsWithoutAFixedNodeKeepTheirGauge) {
  RandomGraph first(20, 3, 0.1, 9), second(15, 2, 0.1, 10);
  PoseGraph graph = first.graph;
  for (const PoseGraphEdge& edge : second.graph.edges) {
    graph.edges.push_back({edge.a + 20, edge.b + 20, edge.a_from_b, 1});
  }
  for (const Sim3& node : second.graph.node_from_world) graph.node_from_world.push_back(node);
  graph.fixed.assign(35, 0);
  PoseGraphOptions options;
  options.min_relative_decrease = 0;
  const PoseGraphReport report = OptimisePoseGraph(&graph, options);
  EXPECT_LT(report.final_cost, 1e-12);
  for (int i = 0; i < 14; ++i) {
    EXPECT_LT(Difference(graph.node_from_world[20 + i] * graph.node_from_world[34].Inverse(),
                         second.truth[i] * second.truth[14].Inverse()),
              1e-5);
  }
  // Nothing says where the component is, so it stays about where it was.
  EXPECT_LT(Difference(graph.node_from_world[20], second.graph.node_from_world[0]), 1);
}

TEST(OptimisePoseGraph, RobustLossLeavesAWrongLoopOut) {
  const auto error = [](double huber_threshold) {
    Random random(11);
    SyntheticLoop loop = MakeDriftingLoop(100, 1, 5, 0.02, 0.02, &random, 0.001);
    const SE3 wrong = Perturbed(SE3(), 5, 1, &random);
    loop.graph.edges.push_back({70, 20, Sim3(wrong), 1});
    PoseGraphOptions options;
    options.huber_threshold = huber_threshold;
    options.max_iterations = 100;
    OptimisePoseGraph(&loop.graph, options);
    return LoopError(loop);
  };
  EXPECT_GT(error(0), 1);
  EXPECT_LT(error(0.005), 0.3);
}

TEST(OptimisePoseGraph, WeightsDecideBetweenEdgesThatDisagree) {
  PoseGraph graph;
  graph.node_from_world.assign(2, Sim3());
  graph.fixed = {1, 0};
  graph.edges = {{1, 0, Sim3(1, Eigen::Quaterniond::Identity(), {1, 0, 0}), 3},
                 {1, 0, Sim3(1, Eigen::Quaterniond::Identity(), {2, 0, 0}), 1}};
  OptimisePoseGraph(&graph, {});
  EXPECT_LT((graph.node_from_world[1].translation() - Eigen::Vector3d(1.25, 0, 0)).norm(), 1e-6);
}

TEST(OptimisePoseGraph, HasNothingToDoWithoutEdgesOrFreeNodes) {
  PoseGraph graph;
  EXPECT_TRUE(OptimisePoseGraph(&graph, {}).converged);
  RandomGraph problem(5, 2, 0.1, 12);
  problem.graph.fixed.assign(5, 1);
  const std::vector<Sim3> before = problem.graph.node_from_world;
  EXPECT_TRUE(OptimisePoseGraph(&problem.graph, {}).converged);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(SameBits(problem.graph.node_from_world[i], before[i]));
}

TEST(OptimisePoseGraph, StopsWhenAsked) {
  RandomGraph problem(30, 3, 0.2, 13);
  int asked = 0;
  const PoseGraphReport report = OptimisePoseGraph(&problem.graph, {}, [&] { return ++asked > 2; });
  EXPECT_EQ(report.iterations, 2);
  EXPECT_LT(report.final_cost, report.initial_cost);
}

TEST(OptimisePoseGraph, TheSameGraphGivesTheSameBits) {
  RandomGraph a(50, 4, 0.2, 14), b(50, 4, 0.2, 14);
  OptimisePoseGraph(&a.graph, {});
  OptimisePoseGraph(&b.graph, {});
  for (int i = 0; i < 50; ++i) {
    EXPECT_TRUE(SameBits(a.graph.node_from_world[i], b.graph.node_from_world[i]));
  }
}

TEST(OptimisePoseGraph, RefusesWhatCannotBe) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const PoseGraph good = RandomGraph(5, 2, 0.1, 15).graph;
  const auto expect_error = [&](const auto& spoil) {
    PoseGraph graph = good;
    spoil(&graph);
    EXPECT_THROW(OptimisePoseGraph(&graph, {}), Error);
  };
  expect_error([](PoseGraph* graph) { graph->fixed.pop_back(); });
  expect_error([](PoseGraph* graph) { graph->edges[0].a = 5; });
  expect_error([](PoseGraph* graph) { graph->edges[0].b = -1; });
  expect_error([](PoseGraph* graph) { graph->edges[0].b = graph->edges[0].a; });
  expect_error([](PoseGraph* graph) { graph->edges[0].weight = -1; });
  expect_error([](PoseGraph* graph) { graph->unit_length = 0; });
  expect_error([&](PoseGraph* graph) { graph->node_from_world[2] = Sim3(SE3(), nan); });
  expect_error([&](PoseGraph* graph) { graph->edges[1].a_from_b = Sim3(SE3(), -1); });
  PoseGraph graph = good;
  PoseGraphOptions options;
  options.max_iterations = -1;
  EXPECT_THROW(OptimisePoseGraph(&graph, options), Error);
}

}  // namespace
}  // namespace deepuav
