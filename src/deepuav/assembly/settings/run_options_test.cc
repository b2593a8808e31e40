#include "deepuav/assembly/settings/run_options.h"

#include <gmock/gmock.h>

#include <limits>

#include "deepuav/base/random.h"
#include "support/option_checks.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;

RunOptions Runnable() {
  RunOptions options;
  options.features.model = "any.onnx";
  return options;
}

/// Far beyond what any option can be, whole, so that it is a value of every numeric type.
std::string Absurd(Random* random) {
  constexpr int kLeast = 500'000'000;
  const double value = random->Uniform(kLeast, std::numeric_limits<int>::max());
  const int sign = random->Uniform(0, 1) < 0.5 ? -1 : 1;
  return std::to_string(sign * static_cast<int>(value));
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
           {"tracking.relocaliser.absolute_pose.confidence", "1"},
           {"mapping.epipolar.ratio", "0"},
           {"mapping.reference.max_angle_deg", "0"},
           {"looping.memory_keyframes", "2"},
           {"mapping.model_noise.initial_sigma_px", "50"},
           {"survey.max_unsettled_sigmas", "3"},
           {"initialiser.absolute_pose.confidence", "1"}}) {
    EXPECT_THAT(ErrorOfSetting(Runnable(), name, value),
                HasSubstr("option " + name + " is " + value + ": expected"));
  }
}

TEST(RunOptions, PlacesAreRecognisedWhereNoLoopIsClosed) {
  RunOptions options = Runnable();
  EXPECT_FALSE(RecognisesPlaces(options));
  options.places.vocabulary = "any.bow";
  EXPECT_TRUE(RecognisesPlaces(options));
  options.system.looping.enabled = false;
  EXPECT_TRUE(RecognisesPlaces(options));
}

TEST(RunOptions, TheDefaultsArePossible) { EXPECT_NO_THROW(Runnable().Check()); }

}  // namespace
}  // namespace deepuav
