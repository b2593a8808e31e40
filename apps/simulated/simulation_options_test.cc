#include "simulated/simulation_options.h"

#include <gmock/gmock.h>

#include "support/option_checks.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;

/// Seeds take any whole number from 0 on.
bool IsAllowed(const std::string& name, const std::string& value) {
  return name.ends_with(".seed") && value.front() != '-';
}

TEST(SimulationOptions, TheDefaultsArePossible) { EXPECT_NO_THROW(SimulationOptions().Check()); }

TEST(SimulationOptions, EveryNumberHasTwoBounds) {
  for (const std::string& name : NumericNames<SimulationOptions>()) {
    for (const std::string value : {"-2000000000", "2000000000"}) {
      if (IsAllowed(name, value)) continue;
      EXPECT_THAT(ErrorOfSetting(SimulationOptions(), name, value),
                  HasSubstr("option " + name + " is "))
          << name << "=" << value;
    }
  }
}

TEST(SimulationOptions, NoNumberIsTakenThatNothingIs) {
  for (const std::string& name : NumericNames<SimulationOptions>()) {
    for (const char* value : {"1e40", "-1e40", "1e308", "-1e308"}) {
      const std::string message = ErrorOfSetting(SimulationOptions(), name, value);
      EXPECT_THAT(message, HasSubstr("option " + name + " is ")) << name << "=" << value;
    }
  }
}

}  // namespace
}  // namespace deepuav
