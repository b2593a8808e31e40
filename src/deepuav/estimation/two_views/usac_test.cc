#include "deepuav/estimation/two_views/usac.h"

#include <gtest/gtest.h>

#include <opencv2/core/utility.hpp>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr double kThresholdPx = 2, kConfidence = 0.9999;
constexpr int kIterations = 2000;

/// Pixels of a plane in two pictures; a share of the pairs is of anything.
struct PlanePairs {
  explicit PlanePairs(double outlier_share, int count = 300, uint64_t seed = 3) {
    Random random(seed);
    for (int i = 0; i < count; ++i) {
      const cv::Vec3d at(random.Uniform(0, 750), random.Uniform(0, 480), 1);
      const cv::Vec3d moved = truth * at;
      a.emplace_back(at[0], at[1]);
      b.emplace_back(moved[0] / moved[2] + random.Gaussian(0.3),
                     moved[1] / moved[2] + random.Gaussian(0.3));
      outlier.push_back(i < outlier_share * count);
      if (outlier.back()) b.back() = {random.Uniform(0, 750), random.Uniform(0, 480)};
    }
  }

  const cv::Matx33d truth{0.95, 0.08, 12, -0.05, 1.02, -7, 4e-5, -3e-5, 1};
  std::vector<cv::Point2d> a, b;
  std::vector<uint8_t> outlier;
};

struct Found {
  cv::Mat model;
  std::vector<uint8_t> inlier;
};

Found FindPlane(const PlanePairs& pairs, uint64_t seed, double threshold = kThresholdPx) {
  Found found;
  found.model = cv::findHomography(pairs.a, pairs.b, found.inlier,
                                   MakeUsacParams(threshold, kConfidence, kIterations, seed));
  return found;
}

Found FindEpipolar(const std::vector<cv::Point2d>& a, const std::vector<cv::Point2d>& b,
                   uint64_t seed) {
  Found found;
  found.model =
      cv::findFundamentalMat(a, b, found.inlier, MakeUsacParams(1, kConfidence, kIterations, seed));
  return found;
}

bool Same(const Found& a, const Found& b) {
  return a.inlier == b.inlier && a.model.size() == b.model.size() &&
         (a.model.empty() || cv::norm(a.model, b.model) == 0);
}

TEST(Usac, TellsInliersFromOutliersUpToAHighShareOfThese) {
  for (const double share : {0.0, 0.2, 0.5, 0.7}) {
    const PlanePairs pairs(share);
    const Found found = FindPlane(pairs, 7);
    ASSERT_EQ(found.model.rows, 3) << share;
    int missed = 0, wrong = 0;
    for (size_t i = 0; i < pairs.outlier.size(); ++i) {
      missed += !pairs.outlier[i] && !found.inlier[i];
      wrong += pairs.outlier[i] && found.inlier[i];
    }
    // By chance one in 30,000 outliers lies within 2 px.
    EXPECT_LE(missed, 3) << share;
    EXPECT_LE(wrong, 1) << share;
    for (const cv::Vec3d& corner : {cv::Vec3d(0, 0, 1), cv::Vec3d(750, 480, 1)}) {
      const cv::Vec3d expected = pairs.truth * corner;
      const cv::Mat moved = found.model * cv::Mat(corner);
      const double x = moved.at<double>(0) / moved.at<double>(2),
                   y = moved.at<double>(1) / moved.at<double>(2);
      EXPECT_NEAR(x, expected[0] / expected[2], 1) << share;
      EXPECT_NEAR(y, expected[1] / expected[2], 1) << share;
    }
  }
}

TEST(Usac, DependsOnItsArgumentsAlone) {
  const PlanePairs pairs(0.6);
  const int threads = cv::getNumThreads();
  const Found first = FindPlane(pairs, 11);
  for (const int other : {1, 4}) {
    cv::setNumThreads(other);
    cv::theRNG().state = static_cast<uint64_t>(other);
    FindPlane(PlanePairs(0.3, 50), 5);  // What was done before does not matter.
    EXPECT_TRUE(Same(FindPlane(pairs, 11), first)) << other;
  }
  cv::setNumThreads(threads);
}

TEST(Usac, SeedsOf64BitsDifferInTheirUpperHalfToo) {
  const auto state = [](uint64_t seed) {
    return MakeUsacParams(1, 0.99, 10, seed).randomGeneratorState;
  };
  EXPECT_NE(state(1), state(2));
  EXPECT_NE(state(1), state((uint64_t{5} << 32) + 1));
  for (const uint64_t seed : {uint64_t{0}, ~uint64_t{0}, uint64_t{1} << 63, uint64_t{0x7fffffff}})
    EXPECT_GE(state(seed), 0) << seed;
}

TEST(Usac, TheThresholdIsInTheUnitOfThePoints) {
  PlanePairs pairs(0);
  for (size_t i = 0; i < 60; ++i) pairs.b[i] += cv::Point2d(5, 0);  // Off by 5 px together.
  const auto count_moved = [&](double threshold) {
    const Found found = FindPlane(pairs, 3, threshold);
    return std::count(found.inlier.begin(), found.inlier.begin() + 60, uint8_t{1});
  };
  EXPECT_LE(count_moved(2), 3);
  EXPECT_GE(count_moved(8), 50);
}

TEST(Usac, OfDegenerateSetsGivesNothingOrAModelOfNumbersAndTheSameEachTime) {
  Random random(9);
  std::vector<std::vector<cv::Point2d>> sets;
  sets.emplace_back(40, cv::Point2d(100, 100));  // One point.
  sets.emplace_back();                           // On a line.
  for (int i = 0; i < 40; ++i) sets.back().emplace_back(10 * i, 3 * i + 5);
  sets.emplace_back();  // Two places.
  for (int i = 0; i < 40; ++i) sets.back().emplace_back(i % 2 == 0 ? 20 : 400, 90);
  for (const auto& a : sets) {
    std::vector<cv::Point2d> b = a;
    for (cv::Point2d& point : b) point += cv::Point2d(3, 4);
    const Found found = FindEpipolar(a, b, 1);
    EXPECT_TRUE(found.model.empty() || cv::checkRange(found.model));
    EXPECT_TRUE(Same(found, FindEpipolar(a, b, 1)));
  }
}

TEST(Usac, OfNoiseAloneKeepsFew) {
  Random random(10);
  std::vector<cv::Point2d> a, b;
  for (int i = 0; i < 200; ++i) {
    a.emplace_back(random.Uniform(0, 750), random.Uniform(0, 480));
    b.emplace_back(random.Uniform(0, 750), random.Uniform(0, 480));
  }
  PlanePairs noise(0);
  noise.a = a, noise.b = b;
  const Found plane = FindPlane(noise, 2);
  EXPECT_LT(std::count(plane.inlier.begin(), plane.inlier.end(), uint8_t{1}), 12);
}

}  // namespace
}  // namespace deepuav
