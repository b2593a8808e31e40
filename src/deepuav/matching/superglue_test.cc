#include "deepuav/matching/superglue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48, kDimension = 8;

/// Similarity 20 <d0, d1> - 5 |k0 - k1|^2, dual softmax times both scores: see
/// tests/make_tiny_superglue.py. The masked one gives logarithms.
std::string TinyNetwork(bool masked) {
  return std::string(DEEPUAV_MATCHING_TESTDATA) +
         (masked ? "/tiny_superglue_masked.onnx" : "/tiny_superglue.onnx");
}

Features RandomFeatures(int count, uint64_t seed, int dimension = kDimension) {
  Random random(seed);
  Features features{{}, Descriptors(dimension)};
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2f px(static_cast<float>(random.Uniform(0, kWidth)),
                             static_cast<float>(random.Uniform(0, kHeight)));
    features.keypoints.push_back({px, px, 1 - 0.01f * static_cast<float>(i), 1});
    Eigen::VectorXf descriptor(dimension);
    for (float& value : descriptor) value = static_cast<float>(random.Gaussian(1));
    descriptor.normalize();
    features.descriptors.Append({descriptor.data(), static_cast<size_t>(dimension)});
  }
  return features;
}

/// The features in another order and a little moved; `order[k]` is where key point k came from.
Features Shuffled(const Features& features, const std::vector<int>& order) {
  Features shuffled{{}, Descriptors(features.descriptors.dimension())};
  for (size_t k = 0; k < order.size(); ++k) {
    shuffled.keypoints.push_back(features.keypoints[static_cast<size_t>(order[k])]);
    shuffled.keypoints.back().image_px += Eigen::Vector2f(1, -1);
    shuffled.keypoints.back().score = 1 - 0.01f * static_cast<float>(k);
    shuffled.descriptors.AppendFrom(features.descriptors, order[k]);
  }
  return shuffled;
}

Features First(const Features& features, int count) {
  Features first{{}, Descriptors(features.descriptors.dimension())};
  for (int k = 0; k < count; ++k) {
    first.keypoints.push_back(features.keypoints[static_cast<size_t>(k)]);
    first.descriptors.AppendFrom(features.descriptors, k);
  }
  return first;
}

std::vector<int> Reversed(int count) {
  std::vector<int> order(static_cast<size_t>(count));
  std::iota(order.rbegin(), order.rend(), 0);
  return order;
}

/// How often key point k of `count` stands among `network_keypoints`, where those repeat.
int Repetitions(int k, int count, int network_keypoints) {
  return network_keypoints / count + (k < network_keypoints % count ? 1 : 0);
}

/// What the tiny network says of the first key points, computed here. `network_keypoints` of 0:
/// without repetitions.
Eigen::MatrixXd ExpectedAssignment(const Features& a, const Features& b, int network_keypoints) {
  const int rows = a.size(), columns = b.size();
  const auto weight = [&](int k, int count) {
    return network_keypoints ? Repetitions(k, count, network_keypoints) : 1;
  };
  Eigen::MatrixXd e(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const Keypoint &p = a.keypoints[static_cast<size_t>(i)],
                     &q = b.keypoints[static_cast<size_t>(j)];
      const double distance = (p.image_px - q.image_px).norm() / (kWidth / 2.0);
      e(i, j) =
          std::exp(20 * a.descriptors.Similarity(i, b.descriptors, j) - 5 * distance * distance);
    }
  }
  Eigen::MatrixXd assignment(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      double over_row = 0, over_column = 0;
      for (int k = 0; k < columns; ++k) over_row += weight(k, columns) * e(i, k);
      for (int k = 0; k < rows; ++k) over_column += weight(k, rows) * e(k, j);
      assignment(i, j) = weight(i, rows) * weight(j, columns) * e(i, j) / over_row * e(i, j) /
                         over_column * a.keypoints[static_cast<size_t>(i)].score *
                         b.keypoints[static_cast<size_t>(j)].score;
    }
  }
  return assignment;
}

std::vector<Match> ExpectedMatches(const Eigen::MatrixXd& assignment, double min_score) {
  std::vector<Match> matches;
  for (int i = 0; i < assignment.rows(); ++i) {
    int j = 0, back = 0;
    const double best = assignment.row(i).maxCoeff(&j);
    assignment.col(j).maxCoeff(&back);
    if (back == i && best >= min_score) matches.push_back({i, j, static_cast<float>(best)});
  }
  return matches;
}

void ExpectSame(const std::vector<Match>& found, const std::vector<Match>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].a, expected[k].a);
    EXPECT_EQ(found[k].b, expected[k].b);
    EXPECT_NEAR(found[k].score, expected[k].score, 1e-4);
  }
}

class SuperGlueTest : public testing::TestWithParam<bool> {
 protected:
  static SuperGlueMatcher Make(int keypoints, double min_score = 0.2) {
    InferenceOptions inference;
    inference.precision = "fp32";
    return {kWidth, kHeight, {TinyNetwork(GetParam()), keypoints, min_score}, inference};
  }
};

TEST_P(SuperGlueTest, GivesTheMutualMaximaOfTheAssignment) {
  SuperGlueMatcher matcher = Make(30);
  const Features a = RandomFeatures(30, 1), b = Shuffled(a, Reversed(30));
  const auto matches = matcher.MatchFeatures(a, b);
  ExpectSame(matches, ExpectedMatches(ExpectedAssignment(a, b, 0), 0.2));
  EXPECT_GE(matches.size(), 20u);
  for (const Match& match : matches) EXPECT_EQ(match.b, 29 - match.a);
}

TEST_P(SuperGlueTest, StrangersAreNotMatched) {
  SuperGlueMatcher matcher = Make(30, 0.9);
  const Features a = RandomFeatures(30, 1), b = RandomFeatures(30, 2);
  ExpectSame(matcher.MatchFeatures(a, b), ExpectedMatches(ExpectedAssignment(a, b, 0), 0.9));
}

/// Counts below N are padded, in any order of calls and without a trace of the call before.
TEST_P(SuperGlueTest, FewerKeypointsThanTheNetworkTakes) {
  constexpr int kNetworkKeypoints = 40;
  SuperGlueMatcher matcher = Make(kNetworkKeypoints);
  for (const auto& [count_a, count_b] :
       std::vector<std::pair<int, int>>{{40, 40}, {25, 13}, {1, 1}, {1, 40}, {39, 2}, {25, 13}}) {
    const Features a = RandomFeatures(count_a, 3);
    const Features whole = RandomFeatures(std::max(count_a, count_b), 3);
    const Features b = Shuffled(whole, Reversed(count_b));
    const int repeated = GetParam() ? 0 : kNetworkKeypoints;
    const auto expected = ExpectedMatches(ExpectedAssignment(a, b, repeated), 0.2);
    EXPECT_FALSE(expected.empty());
    ExpectSame(matcher.MatchFeatures(a, b), expected);
  }
}

TEST_P(SuperGlueTest, MoreKeypointsThanTheNetworkTakes) {
  SuperGlueMatcher matcher = Make(20);
  const Features a = RandomFeatures(50, 4), b = Shuffled(a, Reversed(50));
  ExpectSame(matcher.MatchFeatures(a, b),
             ExpectedMatches(ExpectedAssignment(First(a, 20), First(b, 20), 0), 0.2));
  std::vector<int> order(50);
  std::iota(order.begin(), order.end(), 0);
  const auto matches = matcher.MatchFeatures(a, Shuffled(a, order));
  EXPECT_GE(matches.size(), 10u);
  for (const Match& match : matches) {
    EXPECT_LT(match.a, 20);
    EXPECT_EQ(match.b, match.a);
  }
}

/// The same view at twice the size and in a wider image lies at other places of its network.
TEST_P(SuperGlueTest, ImagesOfTwoSizes) {
  SuperGlueMatcher matcher = Make(30);
  const Features a = RandomFeatures(30, 7), b = Shuffled(a, Reversed(30));
  Features doubled = b;
  for (Keypoint& keypoint : doubled.keypoints) keypoint.image_px *= 2;
  const auto expected = matcher.MatchFeatures(a, b);
  ASSERT_GE(expected.size(), 20u);
  matcher.SetImageSizes({kWidth, kHeight}, {2 * kWidth, 2 * kHeight});
  ExpectSame(matcher.MatchFeatures(a, doubled), expected);
  matcher.SetImageSizes({kWidth, kHeight}, {kWidth, kHeight});
  ExpectSame(matcher.MatchFeatures(a, b), expected);
  EXPECT_NE(matcher.MatchFeatures(a, doubled).size(), expected.size());
}

TEST_P(SuperGlueTest, NoKeypoints) {
  SuperGlueMatcher matcher = Make(10);
  const Features none{{}, Descriptors(kDimension)}, some = RandomFeatures(5, 5);
  EXPECT_TRUE(matcher.MatchFeatures(none, some).empty());
  EXPECT_TRUE(matcher.MatchFeatures(some, none).empty());
  EXPECT_TRUE(matcher.MatchFeatures(none, none).empty());
}

TEST_P(SuperGlueTest, AnotherDimensionIsRefused) {
  SuperGlueMatcher matcher = Make(10);
  const Features a = RandomFeatures(5, 6), b = RandomFeatures(5, 6, 16);
  for (const auto& [first, second] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    try {
      matcher.MatchFeatures(*first, *second);
      ADD_FAILURE() << "no error";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(TinyNetwork(GetParam())));
      EXPECT_THAT(error.what(), HasSubstr("dimension 8"));
      EXPECT_THAT(error.what(), HasSubstr("have 16"));
    }
  }
}

TEST_P(SuperGlueTest, ValuesThatAreNotFiniteAreRefused) {
  SuperGlueMatcher matcher = Make(10);
  Features a = RandomFeatures(5, 6);
  const Features b = a;
  a.keypoints[3].score = std::numeric_limits<float>::quiet_NaN();
  try {
    matcher.MatchFeatures(a, b);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(TinyNetwork(GetParam())));
    EXPECT_THAT(error.what(), HasSubstr("not finite"));
  }
  EXPECT_EQ(matcher.MatchFeatures(b, b).size(), 5u);
}

TEST_P(SuperGlueTest, NamesItsWeights) {
  EXPECT_THAT(Make(10).Description(), HasSubstr("sha256:" + ModelSha256(TinyNetwork(GetParam()))));
}

INSTANTIATE_TEST_SUITE_P(WithoutAndWithMasks, SuperGlueTest, testing::Bool());

/// A network, but no matcher.
constexpr char kNoMatcher[] = R"(<?xml version="1.0"?>
<net name="none" version="11">
  <layers>
    <layer id="0" name="x" type="Parameter" version="opset1">
      <data shape="1,2" element_type="f32"/>
      <output><port id="0" precision="FP32" names="x"><dim>1</dim><dim>2</dim></port></output>
    </layer>
    <layer id="1" name="x_result" type="Result" version="opset1">
      <input><port id="0" precision="FP32"><dim>1</dim><dim>2</dim></port></input>
    </layer>
  </layers>
  <edges><edge from-layer="0" from-port="0" to-layer="1" to-port="0"/></edges>
</net>
)";

TEST(SuperGlueNetworkTest, AnotherNetworkIsRefused) {
  const auto xml = std::filesystem::path(testing::TempDir()) / "superglue_none.xml";
  auto weights = xml;
  weights.replace_extension(".bin");
  std::ofstream(xml) << kNoMatcher;
  std::ofstream(weights) << "";
  try {
    SuperGlueMatcher(kWidth, kHeight, {xml.string(), 10, 0.2}, {});
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(xml.string()));
    EXPECT_THAT(error.what(), HasSubstr("the inputs are x[1,2]: expected keypoints0"));
  }
  std::filesystem::remove(xml);
  std::filesystem::remove(weights);
}

}  // namespace
}  // namespace deepuav
