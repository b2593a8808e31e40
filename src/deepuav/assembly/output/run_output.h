#pragma once

#include <filesystem>
#include <string>

#include "deepuav/assembly/output/run_facts.h"

namespace deepuav {

/// Writes a run's output folder: trajectory.txt, keyframes.txt, points.ply, map.deepuav,
/// frames.csv, poses.csv, timings.csv, options.yaml, camera.yaml, summary.json. The first three
/// hold the map in which most frames lie; the frames of another map N go into trajectory-map-N.txt.
/// Maps are numbered as in map.deepuav; keyframes are those of this run. Where the first map is
/// georeferenced its path is written as trajectory.geojson, trajectory.kml and trajectory.gpx, too.
/// Each file appears only once it is complete. Throws Error naming the first file that could not be
/// written, after all others.
void WriteRunOutput(const std::filesystem::path& folder, const Atlas& atlas, const Camera& camera,
                    const SlamResult& result, const RunFacts& facts);

/// A few lines on how the run went, for a person.
std::string DescribeRun(const Atlas& atlas, const SlamResult& result, const RunFacts& facts);

}  // namespace deepuav
