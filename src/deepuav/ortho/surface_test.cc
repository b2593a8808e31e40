#include "deepuav/ortho/surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/median.h"
#include "deepuav/base/random.h"
#include "deepuav/ortho/gap_filling.h"
#include "deepuav/ortho/ground_frame.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// On a slope, with a hole of 20 by 20 in the middle of 100 by 100.
std::vector<Eigen::Vector3d> Slope(int count) {
  Random random(3);
  std::vector<Eigen::Vector3d> points;
  while (static_cast<int>(points.size()) < count) {
    const double x = random.Uniform(0, 100), y = random.Uniform(0, 100);
    if (std::abs(x - 50) < 10 && std::abs(y - 50) < 10) continue;
    points.emplace_back(500000 + x, 5.2e6 + y, 400 + 0.2 * x + random.Gaussian(0.05));
  }
  return points;
}

TEST(GapFilling, IsLinearBetweenEdges) {
  cv::Mat1f values(40, 60, kNan);
  for (int y = 0; y < values.rows; ++y) values(y, 0) = 0, values(y, 59) = 59;
  FillGaps(&values);
  for (int x = 0; x < values.cols; ++x) EXPECT_NEAR(values(20, x), x, 1.5) << x;
}

TEST(GapFilling, KeepsWhatIsKnown) {
  cv::Mat1f values(3, 3, kNan), nothing(3, 3, kNan);
  values(1, 1) = 7;
  FillGaps(&values);
  EXPECT_EQ(values(1, 1), 7);
  EXPECT_NEAR(values(0, 0), 7, 1e-5);
  FillGaps(&nothing);
  EXPECT_TRUE(std::isnan(nothing(0, 0)));
}

TEST(Surface, LeadsThroughLandmarksAndOverGaps) {
  std::vector<Eigen::Vector3d> points = Slope(2000);
  for (int i = 0; i < 100; ++i) points[static_cast<size_t>(17 * i)].z() += i % 2 ? 30 : -8;
  points.emplace_back(600000, 5.2e6, 0);  // on the horizon
  const Surface surface = FitSurface(points, 0);
  EXPECT_GE(surface.outliers, 95);
  EXPECT_LT(surface.outliers, 300);
  const auto height_at = [&](double x, double y) {
    const Eigen::Vector2d node = surface.grid.NodeOf({500000 + x, 5.2e6 + y});
    return surface
        .Node(static_cast<int>(std::lround(node.x())), static_cast<int>(std::lround(node.y())))
        .z();
  };
  for (const double x : {5.0, 30.0, 50.0, 80.0}) EXPECT_NEAR(height_at(x, 50), 400 + 0.2 * x, 0.5);
  EXPECT_LT(surface.grid.columns * surface.grid.step, 200);
}

TEST(Surface, StepIsAMultipleOfTheUnit) {
  const Surface surface = FitSurface(Slope(2000), 0.3);
  const double cells = surface.grid.step / 0.3;
  EXPECT_NEAR(cells, std::round(cells), 1e-9);
  EXPECT_GE(cells, 1);
  SurfaceOptions few;
  few.max_nodes = 400;
  EXPECT_LE(FitSurface(Slope(2000), 0, few).grid.size(), 500u);
}

TEST(Surface, BadInput) {
  EXPECT_THROW(FitSurface({}, 0), Error);
  EXPECT_THROW(FitSurface(Slope(20), 0), Error);
  EXPECT_THROW(FitSurface(std::vector<Eigen::Vector3d>(100, Eigen::Vector3d(1, 2, 3)), 0), Error);
  SurfaceOptions wrong;
  wrong.support = 0;
  EXPECT_THROW(FitSurface(Slope(100), 0, wrong), Error);
}

TEST(GroundFrame, AMapThatIsNotLevelIsTurned) {
  // Seen straight down: heights along -z, tilted; every tenth point is wrong.
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0).normalized()));
  Random random(5);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 500; ++i) {
    const double off = i % 10 == 0 ? random.Uniform(-3, 0) : random.Gaussian(0.01);
    points.push_back(tilt * Eigen::Vector3d(random.Uniform(-5, 5), random.Uniform(-5, 5), 4 + off));
  }
  const SE3 level = LevelFromWorld(points, {tilt * Eigen::Vector3d(0, 0, 0)});
  std::vector<double> heights;
  for (const Eigen::Vector3d& point : points) heights.push_back((level * point).z());
  const double middle = Median(heights);
  for (double& height : heights) height = std::abs(height - middle);
  EXPECT_LT(Median(heights), 0.02);
  EXPECT_LT(middle, (level * Eigen::Vector3d::Zero()).z());
}

TEST(GroundFrame, OfAPlaceOnEarthIsUtm) {
  Gauge gauge;
  gauge.kind = GaugeKind::kGeoreferenced;
  gauge.origin = {47.4, 8.5, 500};
  const GroundFrame frame = MakeGroundFrame(gauge, {}, {});
  EXPECT_EQ(frame.epsg, 32632);
  const Eigen::Vector3d place(300, -200, 20);
  const Eigen::Vector3d ground = frame.ground_from_world(place);
  EXPECT_NEAR(ground.z(), 520, 0.05);
  EXPECT_LT((frame.world_from_ground(ground) - place).norm(), 1e-5);
}

TEST(GroundFrame, PointsOnALineAreNoGround) {
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 0, 0);
  EXPECT_THROW(LevelFromWorld(line, {}), Error);
  EXPECT_THROW(LevelFromWorld({}, {}), Error);
}

}  // namespace
}  // namespace deepuav
