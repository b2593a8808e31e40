#include "deepuav/base/option_check.h"

#include <gmock/gmock.h>

#include <limits>

namespace deepuav {
namespace {

using ::testing::ThrowsMessage;

struct Pose {
  int rounds = 4;
  int last_round = 4;
  std::string method = "fast";

  void CheckRelations() const {
    CheckOption(last_round <= rounds, "last_round", last_round, "at most rounds");
  }
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rounds", rounds, "", "", Between(1, 50));
    visit("last_round", last_round, "", "", Between(0, 50));
    visit("method", method, "", "", OneOf({"fast", "sure"}));
  }
};

struct Search {
  double radius_px = 8;
  bool enabled = true;
  std::string model = "a.onnx";
  Pose pose = {};
  Pose unnamed = {};

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("radius_px", radius_px, "px", "", Above(0, 1000));
    visit("enabled", enabled, "", "");
    visit("model", model, "", "", NotEmpty("a file"));
    visit.Part("pose", pose);
    visit.Part("", unnamed);
  }
};

void ExpectRefused(const Search& search, const std::string& prefix, const std::string& message) {
  EXPECT_THAT([&] { CheckOptions(prefix, search); }, ThrowsMessage<OptionError>(message));
}

TEST(CheckOptions, LetsPassWhatIsWithinBounds) {
  EXPECT_NO_THROW(CheckOptions("looping.search", Search()));
  EXPECT_NO_THROW(
      CheckOptions("a", Search{.radius_px = 1000, .enabled = false, .pose = {.rounds = 50}}));
}

TEST(CheckOptions, NamesAValueAsItIsRegistered) {
  ExpectRefused({.radius_px = 0}, "looping.search",
                "option looping.search.radius_px is 0: expected more than 0, at most 1000");
  ExpectRefused({.model = ""}, "looping", "option looping.model is empty: expected a file");
  ExpectRefused({.radius_px = std::numeric_limits<double>::quiet_NaN()}, "",
                "option radius_px is nan: expected more than 0, at most 1000");
}

TEST(CheckOptions, NamesAValueOfAPart) {
  ExpectRefused({.pose = {.rounds = 51}}, "looping.search",
                "option looping.search.pose.rounds is 51: expected 1 to 50");
  ExpectRefused({.pose = {.method = ""}}, "looping",
                "option looping.pose.method is '': expected fast or sure");
  ExpectRefused({.unnamed = {.rounds = 0}}, "looping",
                "option looping.rounds is 0: expected 1 to 50");
}

TEST(CheckOptions, NamesWhatContradicts) {
  ExpectRefused({.pose = {.last_round = 5}}, "looping.search",
                "option looping.search.pose.last_round is 5: expected at most rounds");
  EXPECT_THAT([] { CheckOptions("", Pose{.rounds = 1}); },
              ThrowsMessage<OptionError>("option last_round is 4: expected at most rounds"));
}

TEST(CheckOption, ThrowsOnlyWhereTheConditionFails) {
  EXPECT_NO_THROW(CheckOption(true, "tracking.keypoints", 5, "more than 0"));
  EXPECT_THAT(
      [] { CheckOption(false, "tracking.max_error", -0.5, "more than 0"); },
      ThrowsMessage<OptionError>("option tracking.max_error is -0.5: expected more than 0"));
}

}  // namespace
}  // namespace deepuav
