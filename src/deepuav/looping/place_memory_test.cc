#include "deepuav/looping/place_memory.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "support/options_with.h"
#include "support/synthetic_places.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

/// Two flights over one strip in two maps.
class PlaceMemoryTest : public testing::Test {
 protected:
  PlaceMemoryTest() {
    for (MapId map : {made_.AddMap(), made_.AddMap()})
      visits_.push_back(made_.Add(map, FlightAlongStrip(0, 8, 2.0 * double(map.value), 3)));
    vocabulary_.emplace(VocabularyOf(made_.views));
    places_.emplace(&*vocabulary_, RecogniserOptions{});
  }
  void RememberAll(const Visit& visit) {
    for (KeyframeId id : visit.keyframes) places_->Remember(made_.atlas.At(visit.map).At(id));
  }
  BagOfWords WordsAt(double x, double y = 1) {
    const SyntheticView view =
        world_.View(LookDown({x, y, 12}, 0), {0.5, 0.3, 0, 20}, &made_.random);
    return vocabulary_->Words(view.features->descriptors);
  }
  std::vector<PlaceCandidate> Recognise(const std::vector<BagOfWords>& views,
                                        const std::function<bool(KeyframeId)>& skip = nullptr) {
    return places_->Recognise(made_.atlas, views, skip);
  }

  const FeatureWorld world_ = StripOfGround(1);
  SyntheticVisits made_{world_, 2};
  std::vector<Visit> visits_;
  std::optional<Vocabulary> vocabulary_;
  std::optional<PlaceMemory> places_;
};

TEST_F(PlaceMemoryTest, FindsThePlaceOfEveryImageInItsMap) {
  EXPECT_TRUE(Recognise({WordsAt(9)}).empty()) << "nothing is remembered";
  RememberAll(visits_[1]);
  EXPECT_TRUE(places_->Remembers(visits_[1].keyframes[0]));
  EXPECT_FALSE(places_->Remembers(visits_[0].keyframes[0]));
  for (int k = 0; k < 8; ++k) {
    const auto places = Recognise({WordsAt(3 * k + 0.2)});
    ASSERT_FALSE(places.empty());
    EXPECT_EQ(places[0].keyframe, visits_[1].keyframes[static_cast<size_t>(k)]);
    EXPECT_EQ(places[0].map, MapId{1});
    EXPECT_GT(places[0].similarity, 0.2);
  }
  const double right = Recognise({WordsAt(9)})[0].similarity;
  const Features elsewhere = RandomFeatures(400, 752, 480, FeatureWorld::kDimension, &made_.random);
  for (const PlaceCandidate& place : Recognise({vocabulary_->Words(elsewhere.descriptors)}))
    EXPECT_LT(place.similarity, 0.7 * right);
}

TEST_F(PlaceMemoryTest, TheBestStandsForItsCovisibleOnes) {
  RememberAll(visits_[0]);
  RememberAll(visits_[1]);
  const auto places = Recognise({WordsAt(9)});
  ASSERT_EQ(places.size(), 2u) << "one a map: the others see what these see";
  EXPECT_NE(places[0].map, places[1].map);
  EXPECT_GE(places[0].similarity, places[1].similarity);
  for (const PlaceCandidate& place : places)
    EXPECT_EQ(place.keyframe, visits_[static_cast<size_t>(place.map.value)].keyframes[3]);

  RecogniserOptions options;
  options.group_keyframes = 0;
  options.max_places = 4;
  places_.emplace(&*vocabulary_, options);
  RememberAll(visits_[0]);
  RememberAll(visits_[1]);
  const auto ungrouped = Recognise({WordsAt(9)});
  ASSERT_EQ(ungrouped.size(), 4u);
  for (size_t i = 1; i < 4; ++i) EXPECT_GE(ungrouped[i - 1].similarity, ungrouped[i].similarity);
}

TEST_F(PlaceMemoryTest, SkipsAndForgets) {
  RememberAll(visits_[0]);
  const KeyframeId best = visits_[0].keyframes[3];
  ASSERT_EQ(Recognise({WordsAt(9)})[0].keyframe, best);
  const auto skipping = Recognise({WordsAt(9)}, [&](KeyframeId id) { return id == best; });
  ASSERT_FALSE(skipping.empty());
  EXPECT_NE(skipping[0].keyframe, best);
  EXPECT_TRUE(Recognise({WordsAt(9)}, [](KeyframeId) { return true; }).empty());

  made_.atlas.At(MapId{0}).RemoveKeyframe(best);
  const auto after = Recognise({WordsAt(9)});
  ASSERT_FALSE(after.empty());
  EXPECT_NE(after[0].keyframe, best);
  EXPECT_FALSE(places_->Remembers(best));
  EXPECT_TRUE(places_->Remembers(visits_[0].keyframes[4]));
}

TEST_F(PlaceMemoryTest, FindsKeyframesInTheMapThatTookTheirs) {
  RememberAll(visits_[0]);
  made_.atlas.Merge(MapId{0}, MapId{1}, visits_[1].keyframes[0]);
  const auto places = Recognise({WordsAt(9)});
  ASSERT_FALSE(places.empty());
  EXPECT_EQ(places[0].keyframe, visits_[0].keyframes[3]);
  EXPECT_EQ(places[0].map, MapId{1});
}

TEST_F(PlaceMemoryTest, TakesTheHeadingThatFitsBest) {
  RememberAll(visits_[0]);
  const Features noise = RandomFeatures(400, 752, 480, FeatureWorld::kDimension, &made_.random);
  const BagOfWords wrong = vocabulary_->Words(noise.descriptors), right = WordsAt(9);
  const auto upright = Recognise({right}), turned = Recognise({wrong, wrong, right, wrong});
  ASSERT_FALSE(turned.empty());
  EXPECT_EQ(turned[0].keyframe, upright[0].keyframe);
  EXPECT_EQ(turned[0].similarity, upright[0].similarity);
}

TEST(RecogniserOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(RecogniserOptions().Check());
  EXPECT_THROW(OptionsWith(&RecogniserOptions::max_hits, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&RecogniserOptions::min_similarity, -0.1).Check(), Error);
  EXPECT_THROW(OptionsWith(&RecogniserOptions::min_relative_similarity, 1.1).Check(), Error);
  EXPECT_THROW(OptionsWith(&RecogniserOptions::group_keyframes, -1).Check(), Error);
  EXPECT_THROW(OptionsWith(&RecogniserOptions::max_places, 0).Check(), Error);
}

}  // namespace
}  // namespace deepuav
