#include "deepuav/matching/nearest_neighbour.h"

#include <gtest/gtest.h>

#include <numeric>

#include "deepuav/base/error.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr int kDimension = 32;

using Rows = std::vector<std::vector<float>>;

Features FeaturesOf(const Rows& rows) {
  Features features{{}, Descriptors(kDimension)};
  for (const auto& row : rows) {
    const auto place = static_cast<double>(features.size());
    features.keypoints.push_back(KeypointAt({10 * place, 5 * place}));
    features.descriptors.Append(row);
  }
  return features;
}

Rows RandomRows(int count, Random* random) {
  Rows rows;
  for (int i = 0; i < count; ++i) rows.push_back(RandomDescriptor(kDimension, random));
  return rows;
}

/// A unit row at this cosine to the unit row `from`.
std::vector<float> RowAt(double cosine, const std::vector<float>& from, Random* random) {
  std::vector<float> other = RandomDescriptor(kDimension, random);
  const float along = std::inner_product(from.begin(), from.end(), other.begin(), 0.0f);
  float squares = 0;
  for (size_t k = 0; k < from.size(); ++k) {
    other[k] -= along * from[k];
    squares += other[k] * other[k];
  }
  const double across = std::sqrt((1 - cosine * cosine) / squares);
  for (size_t k = 0; k < from.size(); ++k) {
    other[k] = static_cast<float>(cosine * from[k] + across * other[k]);
  }
  return other;
}

std::vector<Match> Matches(const Rows& a, const Rows& b,
                           const NearestNeighbourOptions& options = {}) {
  return NearestNeighbourMatcher(options).MatchFeatures(FeaturesOf(a), FeaturesOf(b));
}

TEST(NearestNeighbourMatcher, FindsAPermutationAmongClutter) {
  Random random(1);
  const Rows a = RandomRows(200, &random);
  Rows b = RandomRows(300, &random);
  std::vector<int> place_in_b;
  for (int i = 0; i < 150; ++i) {
    place_in_b.push_back((7 * i + 11) % 300);
    b[static_cast<size_t>(place_in_b.back())] =
        NoisyDescriptor(a[static_cast<size_t>(i)], 0.3, &random);
  }
  const std::vector<Match> matches = Matches(a, b);
  ASSERT_EQ(matches.size(), 150u);
  for (size_t i = 0; i < matches.size(); ++i) {
    EXPECT_EQ(matches[i].a, static_cast<int>(i)) << "by rising a";
    EXPECT_EQ(matches[i].b, place_in_b[i]);
    EXPECT_GT(matches[i].score, 0.9f);
  }
}

TEST(NearestNeighbourMatcher, IsMutual) {
  Random random(2);
  const Rows b = RandomRows(1, &random);
  const Rows a = {RowAt(0.9, b[0], &random), RowAt(0.99, b[0], &random)};
  const std::vector<Match> matches = Matches(a, b);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].a, 1);
}

TEST(NearestNeighbourMatcher, RefusesTheAmbiguousOnEitherSide) {
  Random random(3);
  const Rows one = RandomRows(1, &random);
  const Rows alike = {RowAt(0.95, one[0], &random), RowAt(0.949, one[0], &random)};
  EXPECT_TRUE(Matches(one, alike).empty());
  EXPECT_TRUE(Matches(alike, one).empty());
  EXPECT_EQ(Matches(one, alike, {.ratio = 1}).size(), 1u);
  EXPECT_EQ(Matches(alike, one, {.ratio = 1}).size(), 1u);
  const Rows different = {RowAt(0.95, one[0], &random), RowAt(0.8, one[0], &random)};
  EXPECT_EQ(Matches(one, different).size(), 1u);
  EXPECT_TRUE(Matches(one, different, {.ratio = 0.4}).empty());
}

TEST(NearestNeighbourMatcher, RefusesTheUnlike) {
  Random random(4);
  const Rows a = RandomRows(1, &random);
  EXPECT_EQ(Matches(a, {RowAt(0.72, a[0], &random)}).size(), 1u);
  EXPECT_TRUE(Matches(a, {RowAt(0.68, a[0], &random)}).empty());
  EXPECT_EQ(Matches(a, {RowAt(0.68, a[0], &random)}, {.min_similarity = 0.6}).size(), 1u);
}

TEST(NearestNeighbourMatcher, RefusesTheFar) {
  Random random(5);
  const Rows a = RandomRows(20, &random);
  Rows b = a;
  std::swap(b[0], b[15]);
  EXPECT_EQ(Matches(a, b).size(), 20u);
  const std::vector<Match> near = Matches(a, b, {.max_motion_px = 100});
  EXPECT_EQ(near.size(), 18u);
  for (const Match& match : near) EXPECT_EQ(match.a, match.b);
}

TEST(NearestNeighbourMatcher, OfNothingIsNothing) {
  Random random(6);
  const Rows some = RandomRows(5, &random);
  EXPECT_TRUE(Matches({}, some).empty());
  EXPECT_TRUE(Matches(some, {}).empty());
  EXPECT_TRUE(Matches({}, {}).empty());
}

TEST(NearestNeighbourMatcher, ForgetsTheImagesBefore) {
  Random random(7);
  NearestNeighbourMatcher matcher({});
  const Features many = FeaturesOf(RandomRows(80, &random)),
                 few = FeaturesOf(RandomRows(7, &random));
  EXPECT_EQ(matcher.MatchFeatures(many, many).size(), 80u);
  EXPECT_EQ(matcher.MatchFeatures(few, few).size(), 7u);
  EXPECT_EQ(matcher.MatchFeatures(many, many).size(), 80u);
}

TEST(NearestNeighbourOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(NearestNeighbourOptions().Check());
  EXPECT_THROW((NearestNeighbourOptions{.min_similarity = 1}.Check()), Error);
  EXPECT_THROW((NearestNeighbourOptions{.ratio = 0}.Check()), Error);
  EXPECT_THROW((NearestNeighbourOptions{.max_motion_px = -1}.Check()), Error);
  EXPECT_THROW(NearestNeighbourMatcher({.ratio = 2}), Error);
}

}  // namespace
}  // namespace deepuav
