#include "deepuav/place/place_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr int kAll = 1000;

BagOfWords RandomBag(int vocabulary, int words, Random* random) {
  std::map<int, float> weights;
  for (int i = 0; i < words; ++i)
    weights[random->Index(vocabulary)] += static_cast<float>(random->Uniform(0.1, 1));
  float sum = 0;
  for (const auto& [word, weight] : weights) sum += weight;
  BagOfWords bag;
  for (const auto& [word, weight] : weights) bag.push_back({word, weight / sum});
  return bag;
}

/// What Query must give, by comparing with every bag.
std::vector<PlaceIndex::Hit> Compare(const std::map<KeyframeId, BagOfWords>& bags,
                                     const BagOfWords& query) {
  std::vector<PlaceIndex::Hit> hits;
  for (const auto& [id, bag] : bags) {
    int shared = 0;
    for (const WordWeight& a : query)
      shared += static_cast<int>(std::count_if(
          bag.begin(), bag.end(), [&](const WordWeight& b) { return a.word == b.word; }));
    if (shared > 0) hits.push_back({id, Similarity(query, bag), shared});
  }
  std::stable_sort(hits.begin(), hits.end(),
                   [](const auto& a, const auto& b) { return a.similarity > b.similarity; });
  return hits;
}

TEST(PlaceIndex, FindsWhatSharesWordsMostSimilarFirst) {
  PlaceIndex index;
  index.Add(KeyframeId{3}, {{0, 0.5f}, {5, 0.5f}});
  index.Add(KeyframeId{1}, {{0, 0.25f}, {2, 0.75f}});
  index.Add(KeyframeId{7}, {{9, 1.0f}});
  EXPECT_THAT(index.Query({{0, 0.5f}, {2, 0.5f}}, kAll),
              ElementsAre(PlaceIndex::Hit{KeyframeId{1}, 0.75f, 2},
                          PlaceIndex::Hit{KeyframeId{3}, 0.5f, 1}));
  EXPECT_THAT(index.Query({{100, 1.0f}}, kAll), IsEmpty());
  EXPECT_THAT(index.Query({}, kAll), IsEmpty());
}

TEST(PlaceIndex, GivesEqualOnesByRisingIdAndNoMoreThanAsked) {
  PlaceIndex index;
  for (const int id : {8, 2, 5}) index.Add(KeyframeId{id}, {{1, 1.0f}});
  const auto hits = index.Query({{1, 1.0f}}, 2);
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_EQ(hits[0].keyframe, KeyframeId{2});
  EXPECT_EQ(hits[1].keyframe, KeyframeId{5});
  EXPECT_THAT(index.Query({{1, 1.0f}}, 0), IsEmpty());
}

TEST(PlaceIndex, LeavesOutWhatIsSkipped) {
  PlaceIndex index;
  for (int id = 0; id < 4; ++id) index.Add(KeyframeId{id}, {{1, 1.0f}});
  const auto hits = index.Query({{1, 1.0f}}, 2, [](KeyframeId id) { return id.value < 2; });
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_EQ(hits[0].keyframe, KeyframeId{2});
  EXPECT_EQ(hits[1].keyframe, KeyframeId{3});
}

TEST(PlaceIndex, AgreesWithComparingAllThroughAddAndRemove) {
  Random random(1);
  PlaceIndex index;
  std::map<KeyframeId, BagOfWords> expected;
  for (int step = 0; step < 400; ++step) {
    const KeyframeId id{random.Index(60)};
    ASSERT_EQ(index.Contains(id), expected.contains(id));
    if (index.Contains(id)) {
      EXPECT_EQ(index.At(id), expected[id]);
      index.Remove(id);
      expected.erase(id);
    } else {
      expected[id] = RandomBag(50, 12, &random);
      index.Add(id, expected[id]);
    }
    ASSERT_EQ(index.size(), static_cast<int>(expected.size()));
    const BagOfWords query = RandomBag(50, 12, &random);
    ASSERT_EQ(index.Query(query, kAll), Compare(expected, query));
  }
}

TEST(PlaceIndex, WrongUseIsRefused) {
  PlaceIndex index;
  index.Add(KeyframeId{1}, {{1, 1.0f}});
  EXPECT_THROW(index.Add(KeyframeId{1}, {}), Error);
  EXPECT_THROW(index.Add(KeyframeId{2}, {{-1, 1.0f}}), Error);
  EXPECT_THROW(index.Add(KeyframeId{2}, {{3, 0.5f}, {3, 0.5f}}), Error);
  EXPECT_THROW(index.Add(KeyframeId{2}, {{3, 0.5f}, {1, 0.5f}}), Error);
  EXPECT_FALSE(index.Contains(KeyframeId{2}));
  EXPECT_THROW(index.Remove(KeyframeId{2}), Error);
  EXPECT_THROW(index.At(KeyframeId{2}), Error);
  EXPECT_EQ(index.size(), 1);
}

TEST(PlaceIndex, AnImageWithoutWordsIsNeverFound) {
  PlaceIndex index;
  index.Add(KeyframeId{1}, {});
  EXPECT_TRUE(index.Contains(KeyframeId{1}));
  EXPECT_THAT(index.Query({{0, 1.0f}}, kAll), IsEmpty());
  index.Remove(KeyframeId{1});
  EXPECT_EQ(index.size(), 0);
}

}  // namespace
}  // namespace deepuav
