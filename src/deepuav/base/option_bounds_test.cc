#include "deepuav/base/option_bounds.h"

#include <gtest/gtest.h>

#include <limits>

namespace deepuav {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Case {
  NumberBounds bounds;
  std::string text;
  std::vector<double> in, out;
};

TEST(NumberBounds, HoldWhatTheySay) {
  for (const Case& test : std::vector<Case>{
           {Between(1, 50), "1 to 50", {1, 2.5, 50}, {0.999, 50.001}},
           {Above(0, 50), "more than 0, at most 50", {1e-300, 50}, {0, -1e-300, 50.001}},
           {Below(-1, 1), "-1 to below 1", {-1, 0.999}, {-1.001, 1}},
           {Within(0, 1), "more than 0, below 1", {1e-300, 0.999}, {0, 1}},
           {ZeroOr(Between(10, 50)), "0, or 10 to 50", {0, 10, 50}, {-1, 1, 9, 51}},
           {AnySeed(), "0 to 2147483647", {0, 2147483647}, {-1, 2147483648.0}}}) {
    EXPECT_EQ(test.bounds.Text(), test.text);
    for (const double value : test.in)
      EXPECT_TRUE(test.bounds.Hold(value)) << test.text << ": " << value;
    for (const double value : test.out)
      EXPECT_FALSE(test.bounds.Hold(value)) << test.text << ": " << value;
    for (const double value : {1e308, -1e308, kNan, kInfinity, -kInfinity})
      EXPECT_FALSE(test.bounds.Hold(value)) << test.text << ": " << value;
  }
}

TEST(TextBounds, HoldTheirWords) {
  const TextBounds bounds = OneOf({"road", "river", "rail"});
  EXPECT_EQ(bounds.Text(), "road, river or rail");
  EXPECT_TRUE(bounds.Hold("rail"));
  for (const char* bad : {"", "Rail", "road, river", "roads"}) EXPECT_FALSE(bounds.Hold(bad));
  EXPECT_TRUE(bounds.OrEmpty().Hold(""));
  EXPECT_FALSE(bounds.OrEmpty().Hold("track"));
}

TEST(TextBounds, MayAskForSomeText) {
  EXPECT_TRUE(NotEmpty("a file").Hold("x"));
  EXPECT_FALSE(NotEmpty("a file").Hold(""));
  EXPECT_EQ(NotEmpty("a file").Text(), "a file");
  for (const char* text : {"", "x"}) EXPECT_TRUE(AnyText().Hold(text));
  EXPECT_EQ(AnyText().Text(), "");
}

}  // namespace
}  // namespace deepuav
