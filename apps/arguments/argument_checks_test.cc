#include "arguments/argument_checks.h"

#include <gmock/gmock.h>

#include "arguments/option_bounds_check.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

struct InnerOptions {
  double share = 0.5;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("share", share, "", "a share", Below(0, 1));
  }
};

struct OuterOptions {
  int count = 3;
  bool is_on = true;
  std::string name;
  InnerOptions inner;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("count", count, "", "a count", Between(1, 9));
    visit("is_on", is_on, "", "a switch");
    visit("name", name, "", "a text", AnyText());
    visit.Part("inner", inner);
  }
};

TEST(ArgumentChecks, OneIsCountedInTheSingular) {
  EXPECT_EQ(Counted(0, "map"), "0 maps");
  EXPECT_EQ(Counted(1, "map"), "1 map");
  EXPECT_EQ(Counted(2, "map"), "2 maps");
}

TEST(ArgumentChecks, BoundsAreThoseOfTheOption) {
  const CLI::Validator count = WithinBoundsOf<OuterOptions>("count");
  EXPECT_EQ(count("9"), "");
  EXPECT_EQ(count("10"), "'10': expected 1 to 9");
  EXPECT_EQ(count("nan"), "'nan': expected 1 to 9");
  EXPECT_EQ(count("x"), "'x': expected 1 to 9");
  const CLI::Validator share = WithinBoundsOf<OuterOptions>("inner.share");
  EXPECT_EQ(share("0"), "");
  EXPECT_THAT(share("1"), HasSubstr("expected 0 to below 1"));
}

TEST(ArgumentChecks, OnlyNumbersHaveBounds) {
  for (const char* name : {"share", "name", "is_on", "none"})
    EXPECT_THROW(WithinBoundsOf<OuterOptions>(name), std::bad_optional_access) << name;
}

}  // namespace
}  // namespace deepuav
