#pragma once

#include <filesystem>
#include <string>

#include "deepuav/inference/session.h"

namespace deepuav {

/// What a network is timed on.
struct NetworkBenchOptions {
  int width_px = 752, height_px = 480;  ///< Of images; raised to multiples of 8.
  int points = 512;                     ///< Key points of each image, for matchers.
  double seconds = 2;                   ///< For one network, precision and number of threads.
};

/// Wall-clock time of runs without reading, shaping, or post-processing.
struct NetworkTiming {
  std::string precision;  ///< As Session::precision().
  int threads = 0;        ///< As the runtime granted.
  double median_ms = 0, p10_ms = 0, p90_ms = 0;
  int runs = 0;
};

bool IsQuantisedNetwork(const std::filesystem::path& model);

/// Open dimensions of four-dimensional inputs are taken for [1,1,height,width], of others for
/// [1,points,...]. The values are random, with a fixed seed. Throws Error for a network that
/// cannot have these shapes.
NetworkTiming TimeNetwork(const std::filesystem::path& model, const InferenceOptions& inference,
                          const NetworkBenchOptions& options);

}  // namespace deepuav
