#include "deepuav/survey/pairs/reduced_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/survey/survey_mapper.h"
#include "support/synthetic_places.h"

namespace deepuav {
namespace {

constexpr double kHighM = 60, kLowM = 15;

/// A photograph's number is the grey level of its image, and its size says by how much it is
/// reduced.
GreyImage NumberedImage(int number, const Camera& camera) {
  return GreyImage(camera.height, camera.width, static_cast<uchar>(number));
}

class PreparedReduced : public LenslessExtractor {
 public:
  explicit PreparedReduced(const Camera& camera) : camera_(camera) {}

  void Prepare(int number, int halvings, Features features) {
    prepared_[{number, halvings}] = std::move(features);
  }

  Features Extract(const GreyImage& image) override {
    ++calls;
    const int halvings = image.cols == camera_.width / 2 ? 1 : 2;
    const auto found = prepared_.find({image(0, 0), halvings});
    return found == prepared_.end() ? Features{{}, Descriptors(FeatureWorld::kDimension)}
                                    : found->second;
  }

  int calls = 0;

 private:
  Camera camera_;
  std::map<std::pair<int, int>, Features> prepared_;
};

class PreparedViewsTest : public ::testing::Test {
 protected:
  PreparedViewsTest() : far_(Ground(), 2), near_(Ground(), 3), extractor_(far_.camera()) {}

  static SyntheticWorld Ground() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksOnGround(5000, {-50, -40}, {70, 50}, 3, &random);
    return geometry;
  }

  /// Of a photograph that looks as `world` does, the number.
  int Add(const SE3& pose, FeatureWorld* world, Random* random) {
    const int number = static_cast<int>(views_.size());
    SurveyView view;
    view.frame.id = {number};
    view.frame.time = {number * 1000000000LL};
    view.frame.features = world->View(pose, noise_, random).features;
    view.frame.image =
        std::make_shared<const ImagePyramid>(NumberedImage(number, far_.camera()), 3);
    views_.push_back(std::move(view));
    return number;
  }

  /// What a photograph shows at a part of its size.
  void PrepareReduced(int number, int halvings, const SE3& pose, FeatureWorld* world,
                      Random* random) {
    Features reduced = *world->View(pose, noise_, random).features;
    const auto factor = static_cast<float>(1 << halvings);
    for (Keypoint& keypoint : reduced.keypoints)
      keypoint.image_px = ((keypoint.image_px.array() + 0.5f) / factor - 0.5f).matrix();
    extractor_.Prepare(number, halvings, std::move(reduced));
  }

  SurveyOutcome Run(LenslessExtractor* reduced) {
    SurveyOptions options;
    options.sequence_neighbours = 30;
    NearestNeighbourMatcher matcher{{}};
    PatchOptions no_patches;
    no_patches.enabled = false;
    return SurveyMapper(far_.camera(), 0, options, {&matcher, nullptr, nullptr, reduced}, nullptr,
                        {no_patches, {}, {}})
        .Run(views_);
  }

  const FeatureNoise noise_{0.4, 0.2, 0, 20};
  FeatureWorld far_, near_;
  std::vector<SurveyView> views_;
  PreparedReduced extractor_;
};

/// Photographs of two heights, a quarter and a whole: what one of them shows at its size looks
/// otherwise than what the other does, but the lower ones at a quarter of theirs.
class ReducedViewsTest : public PreparedViewsTest {
 protected:
  ReducedViewsTest() {
    for (const SE3& pose : SurveyPath(2, 4, 6, kHighM)) {
      Random random(views_.size() + 10);
      Add(pose, &far_, &random);
    }
    for (const SE3& pose : SurveyPath(3, 6, 4, kLowM)) {
      Random random(views_.size() + 10);
      const int number = Add(pose, &near_, &random);
      PrepareReduced(number, 2, pose, &far_, &random);
    }
  }
};

/// Of the photographs of one height two are blurred: they look like the others only where both are
/// seen at half of their size.
class BlurredViewsTest : public PreparedViewsTest {
 protected:
  BlurredViewsTest()
      : halved_(Ground(), 4), blurs_{FeatureWorld(Ground(), 5), FeatureWorld(Ground(), 6)} {
    size_t blurred = 0;
    for (const SE3& pose : SurveyPath(2, 4, 6, kHighM)) {
      Random random(views_.size() + 10);
      const bool is_blurred = views_.size() == 2 || views_.size() == 5;
      const int number = Add(pose, is_blurred ? &blurs_[blurred++] : &far_, &random);
      PrepareReduced(number, 1, pose, &halved_, &random);
    }
  }

  FeatureWorld halved_;
  std::array<FeatureWorld, 2> blurs_;
};

TEST_F(BlurredViewsTest, ComeInWhereBothAreSeenAtHalfTheirSize) {
  const auto located = [](const SurveyOutcome& outcome) {
    return std::ranges::count_if(outcome.places,
                                 [](const auto& place) { return place.map.valid(); });
  };
  EXPECT_EQ(located(Run(nullptr)), 6);
  const SurveyOutcome outcome = Run(&extractor_);
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  ASSERT_EQ(located(outcome), 8);
  const Map& map = outcome.atlas.At(outcome.atlas.Remaining().front());
  const auto step = [&](size_t a, size_t b) {
    return (map.At(outcome.places[a].keyframe).cam_from_world.InverseTranslation() -
            map.At(outcome.places[b].keyframe).cam_from_world.InverseTranslation())
        .norm();
  };
  EXPECT_NEAR(step(2, 1) / step(0, 1), 1, 0.02);
  EXPECT_NEAR(step(5, 6) / step(6, 7), 1, 0.02);
}

TEST_F(ReducedViewsTest, TwoHeightsAreOneMapOnlyWhereTheLowerAreReduced) {
  EXPECT_EQ(Run(nullptr).atlas.Remaining().size(), 2u);
  EXPECT_EQ(extractor_.calls, 0);
  const SurveyOutcome outcome = Run(&extractor_);
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  const Map& map = outcome.atlas.At(outcome.atlas.Remaining().front());
  for (size_t v = 0; v < views_.size(); ++v)
    EXPECT_TRUE(outcome.places[v].map.valid()) << "photograph " << v;
  const auto distance = [&](size_t a, size_t b) {
    return (map.At(outcome.places[a].keyframe).cam_from_world.InverseTranslation() -
            map.At(outcome.places[b].keyframe).cam_from_world.InverseTranslation())
        .norm();
  };
  // Three steps of 6 m above, five of 4 m below.
  EXPECT_NEAR(distance(8, 13) / distance(0, 3), 20.0 / 18, 0.01 * 20 / 18);
}

TEST_F(ReducedViewsTest, WhereAllAreMappedNothingIsReduced) {
  views_.resize(8);
  EXPECT_EQ(Run(&extractor_).atlas.Remaining().size(), 1u);
  EXPECT_EQ(extractor_.calls, 0);
}

TEST_F(ReducedViewsTest, KeyPointsComeInPixelsOfTheWholeImageOnce) {
  SurveyView view = views_.back();
  const int as_it_is = view.frame.features->size();
  LookReduced(far_.camera(), &extractor_, &view);
  EXPECT_EQ(view.Halvings(), 2);
  EXPECT_EQ(view.FeaturesAt(0).size(), as_it_is);
  EXPECT_EQ(view.FirstKeypoint(2), as_it_is);
  const Features& quarter = view.FeaturesAt(2);
  ASSERT_GT(quarter.size(), 0);
  ASSERT_EQ(view.frame.features->size(), as_it_is + quarter.size());
  EXPECT_EQ(view.frame.features->descriptors.size(), view.frame.features->size());
  for (int i = 0; i < quarter.size(); ++i) {
    const Keypoint& keypoint = quarter.keypoints[static_cast<size_t>(i)];
    EXPECT_EQ(keypoint.sigma_px, 4);
    // Where the whole image has it, which Prepare() divided by four.
    EXPECT_LT((keypoint.image_px - keypoint.px).norm(), 1e-3);
  }
  EXPECT_EQ(view.frame.features->keypoints.back().image_px, quarter.keypoints.back().image_px);
  const int calls = extractor_.calls;
  LookReduced(far_.camera(), &extractor_, &view);
  EXPECT_EQ(extractor_.calls, calls);
  view = views_.front();
  view.frame.image.reset();
  LookReduced(far_.camera(), &extractor_, &view);
  EXPECT_EQ(view.Halvings(), 0);
}

TEST(ReducedPairsTest, AreOfWhatLooksAlikeReducedAlike) {
  constexpr int kViews = 6, kKeypoints = 150;
  Random random(7);
  const auto look = [&] {
    return std::make_shared<const Features>(
        RandomFeatures(kKeypoints, 640, 480, FeatureWorld::kDimension, &random));
  };
  std::vector<SurveyView> views(kViews);
  for (SurveyView& view : views) {
    view.features_by_halvings = {look(), look(), look()};
    view.frame.features = view.features_by_halvings.front();
  }
  views[4].features_by_halvings[1] = views[1].features_by_halvings[1];
  views[3].features_by_halvings[2] = views[4].features_by_halvings[2];
  std::vector<Descriptors> looks;
  for (const SurveyView& view : views) {
    for (const auto& features : view.features_by_halvings) looks.push_back(features->descriptors);
  }
  const Vocabulary vocabulary = VocabularyOf(looks);
  SurveyOptions options;
  options.sequence_neighbours = 0;
  options.similar_neighbours = 1;
  const auto both = [](const PairCandidate& pair) { return pair.common_halvings > 0; };
  std::vector<PairCandidate> pairs = ChooseReducedPairs(views, {4}, &vocabulary, options);
  std::erase_if(pairs, [&](const PairCandidate& pair) { return !both(pair); });
  EXPECT_EQ(pairs, (std::vector<PairCandidate>{{1, 4, 0, 0, 1}, {3, 4, 0, 0, 2}}));
}

TEST(ReducedPairsTest, OfWhoIsOutsideAloneEitherMayBeReducedOrBoth) {
  std::vector<SurveyView> views(4);
  for (SurveyView& view : views)
    view.frame.features =
        std::make_shared<const Features>(Features{{}, Descriptors(FeatureWorld::kDimension)});
  SurveyOptions options;
  options.sequence_neighbours = 1;
  const std::vector<PairCandidate> expected = {{2, 3, 0, -2},   {2, 3, 0, -1}, {2, 3, 0, 0, 1},
                                               {2, 3, 0, 0, 2}, {2, 3, 0, 1},  {2, 3, 0, 2}};
  EXPECT_EQ(ChooseReducedPairs(views, {3}, nullptr, options), expected);
  EXPECT_TRUE(ChooseReducedPairs(views, {}, nullptr, options).empty());
}

}  // namespace
}  // namespace deepuav
