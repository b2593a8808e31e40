#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "deepuav/assembly/found_calibration.h"
#include "deepuav/assembly/run_options.h"
#include "deepuav/assembly/sensor_use.h"
#include "deepuav/assembly/shipped_models.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/io/map_origin.h"
#include "deepuav/system/slam.h"

namespace deepuav {

/// What a run's summary tells besides its result.
struct RunFacts {
  std::string dataset_path, dataset_kind;
  std::string camera_file;  ///< Given in place of the dataset's own; else empty.
  std::string schedule, features, matcher, vocabulary;
  std::vector<UsedModel> models;
  int images = 0;      ///< Asked for.
  int unreadable = 0;  ///< Left out because they could not be read.
  double wall_s = 0;
  double start_up_s = 0;  ///< From the start of the program to the first frame's features.
  std::map<std::string, std::string> options;
  std::string options_yaml;  ///< The same, for a person and for --config.
  MapOrigin map_origin;
  KeyframeId first_new_keyframe;  ///< Keyframes before it come from maps that were loaded.
  FoundCalibration calibration;
  std::string use;  ///< Sensors, as asked for.
  std::vector<SensorFacts> sensors;
};

/// What networks and options tell; the rest is left as it is.
RunFacts FactsOf(const Eyes& eyes, const RunSettings& settings);

/// Writes a run's output folder: trajectory.txt, keyframes.txt, points.ply, map.deepuav,
/// frames.csv, timings.csv, options.yaml, camera.yaml, summary.json. The first three hold the map
/// in which most frames lie; the frames of another map N go into trajectory-map-N.txt. Maps are
/// numbered as in map.deepuav; keyframes are those of this run. Where the first map is
/// georeferenced its path is written as trajectory.geojson, trajectory.kml and trajectory.gpx, too.
/// Each file appears only once it is complete. Throws Error naming the first file that could not be
/// written, after all others.
void WriteRunOutput(const std::filesystem::path& folder, const Atlas& atlas, const Camera& camera,
                    const SlamResult& result, const RunFacts& facts);

/// The summary.json of WriteRunOutput.
std::string SummaryText(const Atlas& atlas, const SlamResult& result, const RunFacts& facts);

/// The map in which most frames lie, the first of equals; invalid where there is none.
MapId MainMapOf(const Atlas& atlas, const SlamResult& result);

/// A few lines on how the run went, for a person.
std::string DescribeRun(const Atlas& atlas, const SlamResult& result, const RunFacts& facts);

}  // namespace deepuav
