#include "deepuav/survey/growth/torn_ties.h"

#include <gtest/gtest.h>

#include <chrono>

namespace deepuav {
namespace {

/// Views in a row, each tied to the next two.
std::vector<Tie> Row(int views) {
  std::vector<Tie> ties;
  for (int v = 0; v + 1 < views; ++v) {
    ties.push_back({v, v + 1, 10});
    if (v + 2 < views) ties.push_back({v, v + 2, 4});
  }
  return ties;
}

void Tear(int first, int last, std::vector<Tie>* ties) {
  const auto in = [&](int view) { return view >= first && view <= last; };
  for (Tie& tie : *ties) {
    if (in(tie.a) != in(tie.b)) tie.weight = -tie.weight;
  }
}

TEST(TornOff, NothingWhereAllAgrees) {
  EXPECT_TRUE(TornOff(Row(20), 20).empty());
  EXPECT_TRUE(TornOff({}, 5).empty());
}

TEST(TornOff, NothingWhereMoreHoldsThanTears) {
  std::vector<Tie> ties = Row(20);
  ties.push_back({3, 15, -9});
  EXPECT_TRUE(TornOff(ties, 20).empty());
}

TEST(TornOff, OneView) {
  std::vector<Tie> ties = Row(20);
  Tear(7, 7, &ties);
  ties.push_back({7, 15, 12});  // Where it is by mistake.
  EXPECT_EQ(TornOff(ties, 20), std::vector{7});
}

TEST(TornOff, ABlockOfWhichEachIsHeldByTheOthers) {
  std::vector<Tie> ties = Row(20);
  Tear(6, 10, &ties);
  ties.push_back({8, 17, 12});
  ties.push_back({6, 15, 3});
  EXPECT_EQ(TornOff(ties, 20), (std::vector{6, 7, 8, 9, 10}));
}

TEST(TornOff, TheSmallerPart) {
  std::vector<Tie> ties = Row(20);
  Tear(0, 14, &ties);
  EXPECT_EQ(TornOff(ties, 20), (std::vector{15, 16, 17, 18, 19}));
}

TEST(TornOff, ThousandsOfViewsTakeNoTime) {
  std::vector<Tie> ties;
  constexpr int kViews = 2000;
  for (int v = 0; v < kViews; ++v) {
    for (int next = 1; next <= 15; ++next) ties.push_back({v, (v + next) % kViews, 1.0 + v % 7});
  }
  for (size_t i = 0; i < ties.size(); i += 100) ties[i].weight = -ties[i].weight;
  const auto began = std::chrono::steady_clock::now();
  TornOff(ties, kViews);
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(10));
}

}  // namespace
}  // namespace deepuav
