#include "deepuav/assembly/datasets/sensor_use.h"

#include <algorithm>
#include <array>
#include <set>

#include "deepuav/assembly/settings/wrong_use.h"
#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

constexpr const char* kAuto = "auto";
constexpr const char *kCamera = "camera", *kImu = "imu", *kGnss = "gnss", *kBarometer = "barometer",
                     *kAttitude = "attitude";
constexpr std::array kSensors = {kCamera, kImu, kGnss, kBarometer, kAttitude};

std::set<std::string> NamesIn(const std::string& list) {
  std::set<std::string> names;
  for (size_t begin = 0; begin <= list.size();) {
    const size_t comma = std::min(list.find(',', begin), list.size());
    names.insert(list.substr(begin, comma - begin));
    begin = comma + 1;
  }
  return names;
}

SensorStreams Read(const Dataset& dataset, bool may_fail) {
  try {
    return dataset.ReadSensors();
  } catch (const Error& error) {
    if (!may_fail) throw;
    Log().warn("the camera alone is used: {}", error.what());
    return {};
  }
}

}  // namespace

void CheckSensorList(const std::string& list) {
  if (list == kAuto) return;
  const std::set<std::string> names = NamesIn(list);
  for (const std::string& name : names) {
    if (std::ranges::find(kSensors, name) == kSensors.end())
      throw WrongUse(
          "--use: '{}' is no sensor: expected auto, or camera, imu, gnss, barometer and attitude "
          "with commas between",
          name);
  }
  if (!names.contains(kCamera)) throw WrongUse("--use: expected camera among the sensors");
  if (names.contains(kBarometer) && !names.contains(kGnss))
    throw WrongUse(
        "--use: expected gnss with barometer: heights alone do not give a map its place");
  if (names.contains(kAttitude) && !names.contains(kGnss))
    throw WrongUse("--use: expected gnss with attitude: angles alone do not give a map its place");
}

SensorUse ChooseSensors(const std::string& list, SensorStreams streams) {
  SensorUse use;
  if (list == kCamera) return use;
  const bool automatic = list == kAuto;
  const std::set<std::string> names = NamesIn(list);
  const auto wanted = [&](const char* name) { return automatic || names.contains(name); };
  const auto take = [&](const char* name, auto* stream, auto* used, size_t samples,
                        const std::string& obstacle) {
    if (samples == 0) {
      if (automatic) return;
      if (names.contains(name)) throw Error("--use {}: the dataset has no {}", list, name);
      return;
    }
    SensorFacts facts{name, stream->source, samples, wanted(name) && obstacle.empty(), obstacle};
    if (!wanted(name)) facts.note = "not asked for";
    if (facts.used) *used = std::move(*stream);
    use.facts.push_back(facts);
  };
  const bool has_fixes = !streams.gnss.fixes.empty();
  take(kImu, &streams.imu, &use.streams.imu, streams.imu.samples.size(), "");
  take(kGnss, &streams.gnss, &use.streams.gnss, streams.gnss.fixes.size(), "");
  take(kBarometer, &streams.barometer, &use.streams.barometer, streams.barometer.samples.size(),
       has_fixes ? "" : "without position fixes");
  take(kAttitude, &streams.attitude, &use.streams.attitude, streams.attitude.samples.size(),
       has_fixes ? "" : "without position fixes");
  for (const SensorFacts& facts : use.facts) {
    Log().info("{}: {} samples of {}: {}", facts.name, facts.samples, facts.source,
               facts.used ? "used" : facts.note);
  }
  return use;
}

SensorUse ReadSensorsUsed(const std::string& list, const Dataset& dataset) {
  if (list == kCamera) return {};
  return ChooseSensors(list, Read(dataset, list == kAuto));
}

}  // namespace deepuav
