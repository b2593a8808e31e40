#include "deepuav/assembly/datasets/sensor_use.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/assembly/settings/wrong_use.h"

namespace deepuav {
namespace {

SensorStreams AllSensors() {
  SensorStreams streams;
  streams.imu.source = "imu0";
  streams.imu.samples.resize(5);
  streams.gnss.source = "gps0";
  streams.gnss.fixes.resize(4);
  streams.barometer.source = "baro0";
  streams.barometer.samples.resize(3);
  streams.attitude.source = "XMP";
  streams.attitude.samples.resize(2);
  return streams;
}

const SensorFacts& Of(const SensorUse& use, const std::string& name) {
  const auto facts = std::ranges::find(use.facts, name, &SensorFacts::name);
  if (facts == use.facts.end()) throw Error("nothing is said of {}", name);
  return *facts;
}

TEST(SensorUse, AutoTakesAllThatAreThere) {
  const SensorUse use = ChooseSensors("auto", AllSensors());
  EXPECT_EQ(use.streams.imu.samples.size(), 5u);
  EXPECT_EQ(use.streams.gnss.fixes.size(), 4u);
  EXPECT_EQ(use.streams.barometer.samples.size(), 3u);
  EXPECT_EQ(use.streams.attitude.samples.size(), 2u);
  ASSERT_EQ(use.facts.size(), 4u);
  for (const SensorFacts& facts : use.facts) EXPECT_TRUE(facts.used && facts.note.empty());
  EXPECT_EQ(Of(use, "attitude").source, "XMP");
  EXPECT_EQ(Of(use, "attitude").samples, 2u);
  EXPECT_TRUE(ChooseSensors("auto", {}).facts.empty());
}

TEST(SensorUse, WhatIsNotNamedIsSaidAndLeft) {
  const SensorUse use = ChooseSensors("camera,gnss,attitude", AllSensors());
  EXPECT_TRUE(use.streams.imu.samples.empty());
  EXPECT_TRUE(use.streams.barometer.samples.empty());
  EXPECT_EQ(use.streams.attitude.samples.size(), 2u);
  EXPECT_FALSE(Of(use, "imu").used);
  EXPECT_EQ(Of(use, "imu").note, "not asked for");
  EXPECT_TRUE(ChooseSensors("camera", AllSensors()).facts.empty());
}

TEST(SensorUse, HeightsAndAnglesNeedFixes) {
  SensorStreams streams = AllSensors();
  streams.gnss.fixes.clear();
  const SensorUse use = ChooseSensors("auto", streams);
  EXPECT_TRUE(use.streams.barometer.samples.empty());
  EXPECT_TRUE(use.streams.attitude.samples.empty());
  EXPECT_EQ(Of(use, "barometer").note, "without position fixes");
  EXPECT_EQ(Of(use, "attitude").note, "without position fixes");
  EXPECT_TRUE(Of(use, "imu").used);
}

TEST(SensorUse, WhatIsNamedAndNotThereIsAnError) {
  SensorStreams streams = AllSensors();
  streams.attitude.samples.clear();
  EXPECT_NO_THROW(ChooseSensors("auto", streams));
  EXPECT_THROW(ChooseSensors("camera,gnss,attitude", streams), Error);
}

TEST(SensorUse, ListsAreChecked) {
  for (const char* list : {"auto", "camera", "camera,imu", "imu,camera", "camera,gnss,barometer",
                           "camera,gnss,attitude", "camera,imu,gnss,barometer,attitude"})
    EXPECT_NO_THROW(CheckSensorList(list)) << list;
  for (const char* list : {"", "imu", "camera,", "camera,sonar", "camera,barometer",
                           "camera,attitude", "auto,camera", "Camera"})
    EXPECT_THROW(CheckSensorList(list), WrongUse) << list;
}

}  // namespace
}  // namespace deepuav
