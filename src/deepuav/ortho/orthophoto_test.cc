#include "deepuav/ortho/orthophoto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "deepuav/base/median.h"
#include "deepuav/ortho/testing/synthetic_ground.h"

namespace deepuav {
namespace {

struct Made {
  OrthoPlan plan;
  cv::Mat4b image;

  Eigen::Vector2d PlaceOf(double column, double row) const {
    return {plan.raster.west + (column + 0.5) * plan.raster.cell,
            plan.raster.north - (row + 0.5) * plan.raster.cell};
  }
};

Made Make(const MapScene& scene, Photographs* photographs, const OrthoOptions& options = {}) {
  Made made{PlanOrtho(scene, photographs->stored_size().width, options), {}};
  made.image = cv::Mat4b::zeros(made.plan.raster.rows, made.plan.raster.columns);
  double done = 0;
  MakeOrthophoto(
      scene, &made.plan, photographs, options,
      [&](const cv::Rect& window, const cv::Mat& pixels) { pixels.copyTo(made.image(window)); },
      [&](double share) {
        EXPECT_GT(share, done);
        done = share;
      });
  EXPECT_DOUBLE_EQ(done, 1);
  return made;
}

cv::Mat3b TrueColours(const Made& made) {
  cv::Mat3b colours(made.image.size());
  for (int row = 0; row < colours.rows; ++row) {
    for (int column = 0; column < colours.cols; ++column) {
      const Eigen::Vector2d place = made.PlaceOf(column, row);
      colours(row, column) = SyntheticGround::ColourAt(place.x(), place.y());
    }
  }
  return colours;
}

/// How far the patch about a pixel lies from where the ground has its colours, in pixels.
double Displacement(const cv::Mat3b& image, const cv::Mat3b& truth, const cv::Rect& patch) {
  constexpr int kReach = 5;
  double least = 1e300, found = 0;
  for (int dy = -kReach; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      const double off = cv::norm(image(patch), truth(patch + cv::Point(dx, dy)), cv::NORM_L2SQR);
      if (off < least) least = off, found = std::hypot(dx, dy);
    }
  }
  return found;
}

std::vector<double> Displacements(const Made& made) {
  constexpr int kStep = 25, kMargin = 20;
  const cv::Mat3b truth = TrueColours(made);
  cv::Mat3b image;
  cv::cvtColor(made.image, image, cv::COLOR_BGRA2BGR);
  std::vector<double> displacements;
  for (int row = kMargin; row < made.image.rows - kMargin; row += kStep) {
    for (int column = kMargin; column < made.image.cols - kMargin; column += kStep) {
      const cv::Rect patch(column - 12, row - 12, 25, 25);
      cv::Mat alpha;
      cv::extractChannel(made.image(patch), alpha, 3);
      if (cv::countNonZero(alpha) == static_cast<int>(alpha.total()))
        displacements.push_back(Displacement(image, truth, patch));
    }
  }
  return displacements;
}

int HolesWhereThreeSee(const Made& made) {
  const int step = made.plan.cells_a_step;
  const cv::Mat1w& count = made.plan.choice.count;
  int holes = 0;
  for (int row = 0; row < made.image.rows; ++row) {
    for (int column = 0; column < made.image.cols; ++column) {
      const int y = row / step, x = column / step;
      const int fewest =
          std::min({count(y, x), count(y + 1, x), count(y, x + 1), count(y + 1, x + 1)});
      if (fewest >= 3 && made.image(row, column)[3] == 0) ++holes;
    }
  }
  return holes;
}

TEST(Orthophoto, LiesWhereTheGroundLies) {
  const SyntheticGround ground;
  const MapScene scene = ground.Scene(3000, 0.05);
  PicturesInMemory pictures(ground, scene);
  const Made made = Make(scene, &pictures);
  EXPECT_NEAR(made.plan.raster.cell, SyntheticGround::kHeight / 300, 0.02);
  const std::vector<double> displacements = Displacements(made);
  ASSERT_GT(displacements.size(), 100u);
  EXPECT_LE(Median(displacements), 1);
  const auto near = std::count_if(displacements.begin(), displacements.end(),
                                  [](double displacement) { return displacement <= 2; });
  EXPECT_GT(near, 0.98 * static_cast<double>(displacements.size()));
  EXPECT_EQ(HolesWhereThreeSee(made), 0);
  // Far outside nothing is made up.
  EXPECT_EQ(made.image(0, 0)[3], 0);
}

TEST(Orthophoto, SmallBlocksGiveTheSame) {
  const SyntheticGround ground;
  const MapScene scene = ground.Scene(3000, 0);
  PicturesInMemory pictures(ground, scene);
  OrthoOptions options;
  const Made whole = Make(scene, &pictures, options);
  options.mosaic.block_px = 100;
  options.mosaic.cache_mb = 0;
  const Made blocks = Make(scene, &pictures, options);
  EXPECT_EQ(cv::norm(whole.image, blocks.image, cv::NORM_INF), 0);
}

TEST(Orthophoto, BrightnessIsLevelled) {
  const SyntheticGround ground;
  const MapScene scene = ground.Scene(3000, 0);
  PicturesInMemory pictures(ground, scene, {0.75, 1, 1.25});
  const Made made = Make(scene, &pictures);
  std::vector<double> ratios;
  for (int row = 0; row < made.image.rows; row += 7) {
    for (int column = 0; column < made.image.cols; column += 7) {
      if (made.image(row, column)[3] == 0) continue;
      const Eigen::Vector2d place = made.PlaceOf(column, row);
      ratios.push_back(1.0 * made.image(row, column)[1] /
                       SyntheticGround::ColourAt(place.x(), place.y())[1]);
    }
  }
  const double middle = Median(ratios);
  for (double& ratio : ratios) ratio = std::abs(ratio / middle - 1);
  // Photographs that were not levelled differ by 25 percent.
  EXPECT_LT(Median(ratios), 0.04);
}

TEST(Orthophoto, OtherPhotographsStandInForABrokenOne) {
  const SyntheticGround ground;
  const MapScene scene = ground.Scene(3000, 0);
  PicturesInMemory pictures(ground, scene);
  pictures.broken = 7;
  const Made made = Make(scene, &pictures);
  EXPECT_EQ(HolesWhereThreeSee(made), 0);
  EXPECT_LE(Median(Displacements(made)), 1);
}

TEST(Orthophoto, ABuildingHidesWhatLiesBehindIt) {
  SyntheticGround ground;
  const auto is_roof = [](double x, double y) {
    return std::abs(x - 24) < 4 && std::abs(y - 18) < 4;
  };
  ground.height = [is_roof](double x, double y) { return is_roof(x, y) ? 12 : 0; };
  ground.top = 13;
  // East of the wall cameras in the west do not see the ground.
  const auto seen_beside = [](const OrthoPlan& plan) {
    const Eigen::Vector2d node = plan.surface.grid.NodeOf({29.5, 18});
    return plan.choice.count(static_cast<int>(std::lround(node.y())),
                             static_cast<int>(std::lround(node.x())));
  };
  const MapScene scene = ground.Scene(12000, 0);
  PicturesInMemory pictures(ground, scene);
  const Made made = Make(scene, &pictures);
  ground.height = [](double, double) { return 0; };
  EXPECT_LT(seen_beside(made.plan), seen_beside(PlanOrtho(ground.Scene(12000, 0), 320, {})));
  EXPECT_EQ(HolesWhereThreeSee(made), 0);
}

TEST(Orthophoto, HeightsAreTheGrounds) {
  const SyntheticGround ground;
  const MapScene scene = ground.Scene(3000, 0.1);
  OrthoOptions options;
  options.resolution = 0.5;
  const OrthoPlan plan = PlanOrtho(scene, {}, options);
  EXPECT_NEAR(plan.raster.cell, 0.5, 1e-9);
  cv::Mat1f heights(plan.raster.rows, plan.raster.columns);
  MakeDsm(plan, [&](const cv::Rect& window, const cv::Mat& rows) { rows.copyTo(heights(window)); });
  std::vector<double> errors;
  for (int row = 0; row < heights.rows; ++row) {
    for (int column = 0; column < heights.cols; ++column) {
      if (std::isnan(heights(row, column))) continue;
      const double x = plan.raster.west + (column + 0.5) * plan.raster.cell;
      const double y = plan.raster.north - (row + 0.5) * plan.raster.cell;
      errors.push_back(std::abs(static_cast<double>(heights(row, column)) - ground.height(x, y)));
    }
  }
  ASSERT_GT(errors.size(), 5000u);
  EXPECT_LT(Median(errors), 0.1);
  EXPECT_TRUE(std::isnan(heights(0, 0)));
}

TEST(Orthophoto, BadInput) {
  const SyntheticGround ground;
  EXPECT_THROW(PlanOrtho(ground.Scene(20, 0), 320, {}), Error);
  MapScene blind = ground.Scene(1000, 0);
  for (OrthoView& view : blind.scene.views) {
    const SE3 up(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY())),
                 Eigen::Vector3d::Zero());
    view.cam_from_world = up * view.cam_from_world;
  }
  EXPECT_THROW(PlanOrtho(blind, 320, {}), Error);
  OrthoOptions options;
  options.resolution = -1;
  EXPECT_THROW(PlanOrtho(ground.Scene(1000, 0), 320, options), Error);
}

}  // namespace
}  // namespace deepuav
