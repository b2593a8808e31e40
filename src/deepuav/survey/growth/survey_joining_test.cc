#include "deepuav/survey/growth/survey_joining.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/geometry/alignment.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/survey/growth/map_link.h"
#include "deepuav/survey/survey_mapper.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr double kHighM = 40, kLowM = 15;
constexpr int kHigh = 4;  // the first photographs

/// Photographs of ground of which each point is shown by those that are said.
class Photographs : public ::testing::Test {
 protected:
  SE3 Above(double x, double y, double height_m) {
    return Perturbed(LookDown({x, y, height_m}, M_PI / 2), 0.3, 0.05, &random_);
  }

  /// Points of the ground that these photographs show, those of them that look there.
  void Show(int count, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
            const std::vector<int>& views) {
    for (const Eigen::Vector3d& point : LandmarksOnGround(count, from, to, 3, &random_))
      shown_.push_back({point, RandomDescriptor(FeatureWorld::kDimension, &random_), views});
  }

  std::vector<SurveyView> Views() {
    std::vector<Features> features(poses_.size(), {{}, Descriptors(FeatureWorld::kDimension)});
    for (const auto& [point, descriptor, views] : shown_) {
      for (const int v : views) {
        const auto view = static_cast<size_t>(v);
        const Eigen::Vector3d point_cam = poses_[view] * point;
        const Eigen::Vector2d px = camera_.pinhole.Project(point_cam) +
                                   Eigen::Vector2d(random_.Gaussian(0.3), random_.Gaussian(0.3));
        if (px.x() < 0 || px.y() < 0 || px.x() >= camera_.width || px.y() >= camera_.height)
          continue;
        features[view].keypoints.push_back(KeypointAt(px));
        features[view].descriptors.Append(NoisyDescriptor(descriptor, 0.2, &random_));
      }
    }
    std::vector<SurveyView> views;
    for (Features& of_view : features) {
      SurveyView view;
      view.frame.id = {static_cast<int64_t>(views.size())};
      view.frame.time = {static_cast<int64_t>(views.size()) * 1000000000};
      view.frame.features = std::make_shared<const Features>(std::move(of_view));
      views.push_back(std::move(view));
    }
    return views;
  }

  SurveyOutcome Run(const SurveyJoiningOptions& joining = {}) {
    SurveyOptions options;
    options.joining = joining;
    options.sequence_neighbours = 100;
    NearestNeighbourMatcher matcher{{}};
    return SurveyMapper(camera_, 0, options, {&matcher}, nullptr).Run(Views());
  }

  void ExpectAllInOneMapWithin(double error_m, const SurveyOutcome& outcome) const {
    ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
    std::vector<Eigen::Vector3d> found, truth;
    for (size_t v = 0; v < poses_.size(); ++v) {
      ASSERT_TRUE(outcome.places[v].map.valid()) << v;
      found.push_back(outcome.atlas.At(outcome.places[v].map)
                          .At(outcome.places[v].keyframe)
                          .cam_from_world.InverseTranslation());
      truth.push_back(poses_[v].InverseTranslation());
    }
    const auto truth_from_found = Align(found, truth, AlignmentKind::kSimilar);
    ASSERT_TRUE(truth_from_found);
    for (size_t v = 0; v < found.size(); ++v)
      EXPECT_LT((*truth_from_found * found[v] - truth[v]).norm(), error_m) << v;
  }

  struct Shown {
    Eigen::Vector3d point;
    std::vector<float> descriptor;
    std::vector<int> views;
  };

  FeatureWorld world_{SyntheticWorld(), 1};
  Random random_{3};
  const Camera camera_ = world_.camera();
  std::vector<SE3> poses_;
  std::vector<Shown> shown_;
};

/// Four photographs from high up and four from low down. Of what the low ones see a high one has
/// some points, each of which no other high one has: no point of the map is seen from below.
class TwoHeights : public Photographs {
 protected:
  TwoHeights() {
    for (const auto& [x, y] : {std::pair(0.0, 0.0), {14.0, 2.0}, {28.0, 0.0}, {16.0, 12.0}})
      poses_.push_back(Above(x, y, kHighM));
    for (const auto& [x, y] : {std::pair(30.0, 4.0), {34.0, 5.0}, {31.0, 8.0}, {35.0, 9.0}})
      poses_.push_back(Above(x, y, kLowM));
    Show(700, {-25, -20}, {50, 30}, {0, 1, 2, 3});
    Show(400, {18, -4}, {48, 16}, {4, 5, 6, 7});
    Show(60, {24, -2}, {42, 14}, {2, 4, 5, 6, 7});
  }

  void ShowSharedPoints() {
    Show(18, {24, 0}, {34, 14}, {3, 4, 5, 6, 7});
    Show(8, {24, 0}, {34, 14}, {3, 4});
    Show(8, {24, 0}, {34, 14}, {3, 6});
  }
};

TEST_F(TwoHeights, WithoutAPointOfTheMapStayApartWhereOnlyOnePhotographLeadsOver) {
  const SurveyOutcome outcome = Run();
  EXPECT_EQ(outcome.atlas.Remaining().size(), 2u) << "the scale between them is not told";
}

TEST_F(TwoHeights, StayApartWhereTheScaleIsToBeToldBetter) {
  ShowSharedPoints();
  SurveyJoiningOptions joining;
  joining.max_scale_sigma = 1e-6;
  EXPECT_EQ(Run(joining).atlas.Remaining().size(), 2u);
}

TEST_F(TwoHeights, JoinByPhotographsThatEachSharePointsOfTheirOwn) {
  ShowSharedPoints();
  ExpectAllInOneMapWithin(0.2, Run());
}

/// A line of six photographs. The last two show ground that of the others the fourth alone shows,
/// and too few points of what the third shows, too, for a pose.
class EndOfALine : public Photographs {
 protected:
  EndOfALine() {
    for (const auto& [x, y] :
         {std::pair(0.0, 0.0), {12.0, 2.0}, {24.0, -1.0}, {36.0, 1.0}, {47.0, 0.0}, {53.0, 3.0}})
      poses_.push_back(Above(x, y, kHighM));
    Show(900, {-30, -30}, {50, 30}, {0, 1, 2, 3});
    Show(150, {30, -15}, {70, 15}, {3, 4, 5});
  }

  static constexpr int kTooFewForAPose = 17;
};

TEST_F(EndOfALine, ComesInByAPairThatLeadsToIt) {
  Show(kTooFewForAPose, {34, -12}, {40, 12}, {2, 3, 4, 5});
  ExpectAllInOneMapWithin(0.3, Run());
}

TEST_F(EndOfALine, StaysOutsideWhereMoreIsToAgree) {
  Show(kTooFewForAPose, {34, -12}, {40, 12}, {2, 3, 4, 5});
  SurveyJoiningOptions joining;
  joining.min_sights = 1000;
  const SurveyOutcome outcome = Run(joining);
  EXPECT_FALSE(outcome.places[4].map == outcome.places[0].map);
}

TEST_F(EndOfALine, StaysOutsideWhereOnePhotographAloneLeadsThere) {
  const SurveyOutcome outcome = Run();
  for (const size_t v : {4, 5}) {
    EXPECT_FALSE(outcome.places[v].map == outcome.places[0].map)
        << v << ": how far away it is, nothing tells";
  }
}

}  // namespace
}  // namespace deepuav
