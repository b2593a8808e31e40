#include "run_options.h"

#include <gmock/gmock.h>

#include <charconv>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "simulation_options.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;

/// Whether an entry holds a number: then it takes 0, or refuses it by its bounds, and no word.
bool IsNumeric(const OptionEntry& entry) {
  const std::string text = entry.get();
  double number = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  return status == std::errc() && end == text.data() + text.size();
}

template <typename Options>
std::vector<std::string> NumericNames() {
  Options options;
  OptionRegistry registry;
  options.Register(&registry);
  std::vector<std::string> names;
  for (const auto& [name, entry] : registry.entries())
    if (IsNumeric(entry)) names.push_back(name);
  return names;
}

RunOptions Runnable() {
  RunOptions options;
  options.features.model = "any.onnx";
  return options;
}

template <typename Options>
std::string ErrorOfSetting(Options options, const std::string& name, const std::string& value) {
  OptionRegistry registry;
  options.Register(&registry);
  try {
    registry.Set(name, value);
    options.Check();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

/// Far beyond what any option can be, whole, so that it is a value of every numeric type.
std::string Absurd(Random* random) {
  constexpr int kLeast = 500'000'000;
  const double value = random->Uniform(kLeast, std::numeric_limits<int>::max());
  const int sign = random->Uniform(0, 1) < 0.5 ? -1 : 1;
  return std::to_string(sign * static_cast<int>(value));
}

/// Seeds take any whole number from 0 on.
bool IsAllowed(const std::string& name, const std::string& value) {
  return name.ends_with(".seed") && value.front() != '-';
}

TEST(RunOptions, ThreeHundredOutOfRangeAreRefusedByTheirFullNames) {
  const std::vector<std::string> names = NumericNames<RunOptions>();
  ASSERT_GT(names.size(), 140u);
  Random random(31);
  constexpr int kTries = 300;
  for (int i = 0; i < kTries; ++i) {
    const std::string& name =
        names[static_cast<size_t>(random.Index(static_cast<int>(names.size())))];
    const std::string value = Absurd(&random);
    EXPECT_THAT(ErrorOfSetting(Runnable(), name, value), HasSubstr("option " + name + " is "))
        << name << "=" << value;
  }
}

TEST(RunOptions, EveryNumberHasTwoBounds) {
  for (const std::string& name : NumericNames<RunOptions>()) {
    for (const char* value : {"-2000000000", "2000000000"}) {
      EXPECT_THAT(ErrorOfSetting(Runnable(), name, value), HasSubstr("option " + name + " is "))
          << name << "=" << value;
    }
  }
}

TEST(RunOptions, ErrorsNameTheStructThatIsMeant) {
  for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{
           {"looping.verifier.place.max_keyframes", "0"},
           {"mapping.local_map.max_keyframes", "0"},
           {"mapping.local_bundle.max_iterations", "-1"},
           {"mapping.global_bundle.max_iterations", "-1"},
           {"mapping.fusion.projection.ratio", "2"},
           {"tracking.projection.ratio", "2"},
           {"looping.relocaliser.absolute_pose.confidence", "1"},
           {"initialiser.absolute_pose.confidence", "1"}}) {
    EXPECT_THAT(ErrorOfSetting(Runnable(), name, value),
                HasSubstr("option " + name + " is " + value + ": expected"));
  }
}

TEST(RunOptions, TheDefaultsArePossible) {
  EXPECT_NO_THROW(Runnable().Check());
  EXPECT_NO_THROW(SimulationOptions().Check());
}

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
