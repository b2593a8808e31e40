#include "deepuav/features/image_fixed_votes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr int kDimension = 32, kWidth = 640, kHeight = 480;

class Photographer {
 public:
  explicit Photographer(int writing) {
    for (int i = 0; i < writing; ++i) {
      const Eigen::Vector2f place(20 + 14 * (i % 10), 20 + 14 * (i / 10));
      writing_.emplace_back(place, AnyDescriptor());
    }
  }
  /// Of a place of its own.
  std::shared_ptr<const Features> Photograph() {
    Features features;
    features.descriptors = Descriptors(kDimension);
    const auto add = [&features](const Eigen::Vector2f& place, const std::vector<float>& row) {
      features.keypoints.push_back({place, place, 1, 1});
      features.descriptors.Append(row);
    };
    for (int i = 0; i < 400; ++i) add(AnyPlace(kWidth, kHeight), AnyDescriptor());
    for (const auto& [place, row] : writing_) {
      if (Uniform() < 0.8) add(place + 0.3f * Eigen::Vector2f(Uniform(), Uniform()), row);
    }
    return std::make_shared<const Features>(std::move(features));
  }

 private:
  float Uniform() { return static_cast<float>(random_()) / 4294967296.f; }
  Eigen::Vector2f AnyPlace(int width, int height) {
    const float x = Uniform();
    return {x * static_cast<float>(width), Uniform() * static_cast<float>(height)};
  }
  std::vector<float> AnyDescriptor() {
    std::vector<float> row(kDimension);
    Eigen::Map<Eigen::VectorXf> values(row.data(), kDimension);
    for (float& value : row) value = Uniform() - 0.5f;
    values.normalize();
    return row;
  }

  std::mt19937 random_{5};
  std::vector<std::pair<Eigen::Vector2f, std::vector<float>>> writing_;
};

ImageRegion FixedIn(int photographs, int writing) {
  Photographer photographer(writing);
  std::vector<std::shared_ptr<const Features>> taken;
  for (int i = 0; i < photographs; ++i) taken.push_back(photographer.Photograph());
  return FixedInPhotographs(taken, kWidth, kHeight, {});
}

TEST(FixedInPhotographs, FindsWhatAllShowAtTheSamePlace) {
  for (const int photographs : {5, 12, 60}) {
    const ImageRegion region = FixedIn(photographs, 60);
    int covered = 0;
    for (int i = 0; i < 60; ++i)
      covered += region.Covers(
          {20.f + 14.f * static_cast<float>(i % 10), 20.f + 14.f * static_cast<float>(i / 10)});
    EXPECT_GE(covered, photographs < 10 ? 50 : 55) << photographs;
    EXPECT_FALSE(region.Covers({400, 300})) << photographs;
    EXPECT_LT(region.Share(), 0.08) << photographs << ": that of the writing is 0.045";
  }
}

TEST(FixedInPhotographs, FindsNothingElse) {
  EXPECT_TRUE(FixedIn(60, 0).empty());
  EXPECT_TRUE(FixedIn(1, 60).empty());
  EXPECT_TRUE(FixedIn(0, 0).empty());
}

TEST(FixedInPhotographs, OneTakenAgainAndAgainTellsNothing) {
  Photographer photographer(0);
  const std::vector<std::shared_ptr<const Features>> taken(20, photographer.Photograph());
  EXPECT_TRUE(FixedInPhotographs(taken, kWidth, kHeight, {}).empty());
}

TEST(ImageFixedVotes, TheMajorityOfWhatTellsDecides) {
  ImageFixedVotes votes(kWidth, kHeight, {});
  const std::vector<int> telling = {1, 2, 3, 4, 5, 6};
  for (int i = 0; i < 3; ++i) votes.Count(telling, {3});
  EXPECT_TRUE(votes.Region().empty()) << "too few to tell";
  votes.Count(telling, {3});
  EXPECT_TRUE(votes.Region().Covers({3 * 8 + 4, 4}));
  EXPECT_TRUE(votes.Region().Covers({4 * 8 + 4, 12})) << "around it";
  EXPECT_FALSE(votes.Region().Covers({6 * 8 + 4, 4}));
  for (int i = 0; i < 5; ++i) votes.Count(telling, {});
  EXPECT_TRUE(votes.Region().empty());
}

TEST(ImageFixedVotes, ALongTimeDoesNotOutweighWhatIsSeenNow) {
  ImageFixedVotes votes(kWidth, kHeight, {});
  const std::vector<int> telling = {1, 2, 3};
  for (int i = 0; i < 10'000; ++i) votes.Count(telling, {3});
  EXPECT_FALSE(votes.Region().empty());
  for (int i = 0; i < 70; ++i) votes.Count(telling, {});
  EXPECT_TRUE(votes.Region().empty());
}

TEST(ImageFixedVotes, AViewOfWhichTooMuchIsFixedCountsNothing) {
  ImageFixedVotes votes(kWidth, kHeight, {});
  for (int i = 0; i < 100; ++i) votes.Count({1, 2, 3}, {1, 2});
  EXPECT_TRUE(votes.Region().empty());
}

TEST(ImageFixedOptions, AreChecked) {
  ImageFixedOptions options;
  options.cell_px = 0;
  EXPECT_THROW(options.Check(), Error);
  EXPECT_THROW(ImageFixedVotes(kWidth, kHeight, options), Error);
}

}  // namespace
}  // namespace deepuav
