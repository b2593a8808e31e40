#include "deepuav/base/option_bounds.h"

#include <gmock/gmock.h>

#include <limits>

namespace deepuav {
namespace {

using ::testing::ThrowsMessage;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Pose {
  int rounds = 4;
  void Check() const { CheckRange("rounds", rounds, 1, 50); }
};

struct Search {
  double radius_px = 8;
  Pose pose;
  void Check() const {
    CheckPositive("tracking.radius_px", radius_px, 1000);
    pose.Check();
  }
};

TEST(CheckRange, HoldsBothBounds) {
  for (const double good : {1.0, 2.5, 50.0}) EXPECT_NO_THROW(CheckRange("a.b", good, 1, 50));
  EXPECT_THAT([] { CheckRange("a.b", 0, 1, 50); },
              ThrowsMessage<Error>("option a.b is 0: expected 1 to 50"));
  for (const double bad : {0.999, 50.1, 1e308, -1e308, kNan})
    EXPECT_THROW(CheckRange("a.b", bad, 1, 50), Error) << bad;
}

TEST(CheckPositive, LeavesOutZero) {
  for (const double good : {1e-300, 50.0}) EXPECT_NO_THROW(CheckPositive("a.b", good, 50));
  EXPECT_THAT([] { CheckPositive("a.b", 0, 50); },
              ThrowsMessage<Error>("option a.b is 0: expected more than 0, at most 50"));
  for (const double bad : {-1.0, 50.1, kNan})
    EXPECT_THROW(CheckPositive("a.b", bad, 50), Error) << bad;
}

TEST(CheckUnder, NamesTheMemberAsItIsRegistered) {
  Search search;
  EXPECT_NO_THROW(CheckUnder("looping.search", search));
  search.radius_px = -1;
  EXPECT_THAT(
      [&] { CheckUnder("looping.search", search); },
      ThrowsMessage<Error>("option looping.search.radius_px is -1: expected more than 0, at "
                           "most 1000"));
  const Pose pose{.rounds = 51};
  EXPECT_THAT([&] { CheckUnder("looping.search.pose", pose); },
              ThrowsMessage<Error>("option looping.search.pose.rounds is 51: expected 1 to 50"));
}

}  // namespace
}  // namespace deepuav
