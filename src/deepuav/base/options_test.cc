#include "deepuav/base/options.h"

#include <gmock/gmock.h>

#include <limits>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

struct TrackingOptions {
  int keypoints = 1000;
  double max_error = 0.1;
  bool refine = true;
  std::string model = "large.onnx";

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("keypoints", keypoints, "", "most points of a frame", Between(1, 5000));
    visit("max_error", max_error, "px", "greatest reprojection error", Above(0, 10));
    visit("refine", refine, "", "sub-pixel refinement");
    visit("model", model, "", "file of the network");
  }
};

class OptionRegistryTest : public ::testing::Test {
 protected:
  OptionRegistryTest() { registry_.Add("tracking", &options_); }

  void ExpectRefused(const std::string& assignment, const std::string& reason) {
    EXPECT_THAT([&] { registry_.SetAssignment(assignment); },
                ThrowsMessage<Error>(HasSubstr(reason)))
        << assignment;
  }
  std::string Get(const std::string& name) const { return registry_.entries().at(name).get(); }

  TrackingOptions options_;
  OptionRegistry registry_;
};

TEST_F(OptionRegistryTest, ListsWhatThereIs) {
  EXPECT_EQ(registry_.entries().size(), 4u);
  const OptionEntry& entry = registry_.entries().at("tracking.max_error");
  EXPECT_EQ(entry.unit, "px");
  EXPECT_EQ(entry.meaning, "greatest reprojection error");
  EXPECT_EQ(entry.bounds, "more than 0, at most 10");
  EXPECT_EQ(registry_.entries().at("tracking.model").bounds, "");
}

TEST_F(OptionRegistryTest, SetsEveryType) {
  registry_.SetAssignment("tracking.keypoints=-5");
  registry_.SetAssignment("tracking.max_error=2.5e-3");
  registry_.SetAssignment("tracking.refine=off");
  registry_.SetAssignment("tracking.model=a=b.onnx");
  EXPECT_EQ(options_.keypoints, -5);
  EXPECT_EQ(options_.max_error, 2.5e-3);
  EXPECT_FALSE(options_.refine);
  EXPECT_EQ(options_.model, "a=b.onnx");
}

TEST_F(OptionRegistryTest, KnowsTheWordsForTrueAndFalse) {
  for (const char* word : {"true", "1", "yes", "on"}) {
    options_.refine = false;
    registry_.Set("tracking.refine", word);
    EXPECT_TRUE(options_.refine) << word;
  }
  for (const char* word : {"false", "0", "no", "off"}) {
    options_.refine = true;
    registry_.Set("tracking.refine", word);
    EXPECT_FALSE(options_.refine) << word;
  }
}

TEST_F(OptionRegistryTest, WhatItPrintsItReadsBack) {
  for (const double value :
       {0.1, 1.0 / 3, -7e-300, 1e22, 5.0, std::numeric_limits<double>::max()}) {
    options_.max_error = value;
    registry_.Set("tracking.max_error", Get("tracking.max_error"));
    EXPECT_EQ(options_.max_error, value);
  }
  EXPECT_EQ(Get("tracking.keypoints"), "1000");
  EXPECT_EQ(Get("tracking.refine"), "true");
  EXPECT_EQ(Get("tracking.model"), "large.onnx");
  options_.max_error = 0.1;
  EXPECT_EQ(Get("tracking.max_error"), "0.1");
}

TEST_F(OptionRegistryTest, NamesTheNearestKnownOption) {
  ExpectRefused("tracking.keypoint=3", "'tracking.keypoints'");
  ExpectRefused("trakcing.max_eror=3", "'tracking.max_error'");
  ExpectRefused("refine=1", "'tracking.refine'");
  ExpectRefused("tracking.KEYPOINTS=3", "unknown option 'tracking.KEYPOINTS'");
}

TEST(OptionRegistry, NamesNoneWhereThereIsNone) {
  OptionRegistry empty;
  EXPECT_THAT(
      [&] { empty.Set("a", "1"); },
      ThrowsMessage<Error>(AllOf(HasSubstr("unknown option 'a'"), Not(HasSubstr("nearest")))));
}

TEST_F(OptionRegistryTest, RefusesBadValuesAndKeepsTheOldOnes) {
  for (const char* value : {"", "many", "3.5", "3 ", " 3", "0x10", "99999999999"}) {
    ExpectRefused(std::string("tracking.keypoints=") + value, "expected a whole number");
  }
  for (const char* value : {"", "low", "1,5", "1.5px", "1e999"}) {
    ExpectRefused(std::string("tracking.max_error=") + value, "expected a number");
  }
  for (const char* value : {"", "maybe", "True", "2"}) {
    ExpectRefused(std::string("tracking.refine=") + value, "expected true or false");
  }
  EXPECT_EQ(options_.keypoints, 1000);
  EXPECT_EQ(options_.max_error, 0.1);
  EXPECT_TRUE(options_.refine);
}

TEST_F(OptionRegistryTest, NamesTheOptionAndTheValueFound) {
  ExpectRefused("tracking.keypoints=many", "tracking.keypoints is 'many'");
}

TEST_F(OptionRegistryTest, RefusesNumbersThatAreNotFinite) {
  ExpectRefused("tracking.max_error=nan", "expected a finite number");
  ExpectRefused("tracking.max_error=-inf", "expected a finite number");
}

TEST_F(OptionRegistryTest, RefusesWhatIsNoAssignment) {
  ExpectRefused("tracking.keypoints", "expected name=value");
  ExpectRefused("=5", "expected name=value");
  ExpectRefused("", "expected name=value");
}

struct MappingOptions {
  TrackingOptions fine, coarse;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit.Part("fine", fine);
    visit.Part("", coarse);
  }
};

TEST(OptionRegistry, NamesPartsUnderTheStructTheyLieIn) {
  MappingOptions options;
  OptionRegistry registry;
  registry.Add("mapping", &options);
  registry.Set("mapping.fine.keypoints", "5");
  registry.Set("mapping.keypoints", "7");
  EXPECT_EQ(options.fine.keypoints, 5);
  EXPECT_EQ(options.coarse.keypoints, 7);
  EXPECT_EQ(registry.entries().size(), 8u);
}

}  // namespace
}  // namespace deepuav
