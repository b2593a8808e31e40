#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/assembly/datasets/sensor_use.h"
#include "deepuav/assembly/networks/eyes.h"
#include "deepuav/assembly/output/found_calibration.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/io/geodata/map_origin.h"
#include "deepuav/system/slam.h"

namespace deepuav {

/// What a live run's summary tells of its images.
struct LiveFacts {
  int64_t arrived = 0, frozen = 0, misfits = 0, reconnects = 0;  ///< As LiveCounts.
  double median_latency_s = 0, p95_latency_s = 0;  ///< From an image's arrival to its pose.
  int64_t posed = 0;                               ///< Frames that these are of, the latest.
  int64_t late = 0;                                ///< As LiveCounts.
};

/// What a run's summary tells besides its result.
struct RunFacts {
  std::string dataset_path, dataset_kind;
  std::string camera_file;  ///< Given in place of the dataset's own; else empty.
  std::string schedule, features, matcher, vocabulary;
  std::vector<UsedModel> models;
  int images = 0;      ///< Asked for.
  int unreadable = 0;  ///< Left out because they could not be read.
  int damaged = 0;     ///< Used as far as they go.
  double wall_s = 0;
  double start_up_s = 0;  ///< From the start of the program to the first frame's features.
  std::map<std::string, std::string> options;  ///< As the run had them.
  std::string options_yaml;                    ///< As they were asked for, for --config.
  MapOrigin map_origin;
  KeyframeId first_new_keyframe;  ///< Keyframes before it come from maps that were loaded.
  FoundCalibration calibration;
  std::string use;  ///< Sensors, as asked for.
  std::vector<SensorFacts> sensors;
  std::optional<LiveFacts> live;
};

/// What networks and options tell; the rest is left as it is.
RunFacts FactsOf(const Eyes& eyes, const RunSettings& settings);

using FrameCounts = std::map<MapId, int>;

/// Has an entry for every map of the atlas.
FrameCounts FramesByMap(const Atlas& atlas, const SlamResult& result);

/// The map in which most frames lie, the first of equals; invalid where there is none.
MapId MainMap(const FrameCounts& frames_by_map);

/// Of this process until now.
double PeakResidentMb();

}  // namespace deepuav
