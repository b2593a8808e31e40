#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/system/slam.h"
#include "stored_sequence.h"

namespace deepuav {

/// Where the camera truly was, and how far what it saw.
struct TruthOfFrames {
  std::vector<std::optional<Eigen::Vector3d>> centre;  ///< Per frame.
  std::vector<double> depth_m;                         ///< Per frame.
};

/// What became of a window: whether a map started, and whether it is right.
struct Verdict {
  bool has_parallax = false, started = false, judged = false, wrong = false;
  double delay_s = 0, delay_after_parallax_s = 0, shape_error = 0, scale_change = 0;
  int located = 0, first_online = -1;
};

/// The map with most located frames; nothing where there is none.
std::optional<MapId> LargestMap(const SlamResult& result);

/// The scale that makes the distances of the points from their middle those of the others.
double ScaleBetween(const std::vector<Eigen::Vector3d>& from,
                    const std::vector<Eigen::Vector3d>& to);

/// `truth`: of all frames of the dataset; `result`: of a run over the part.
Verdict JudgeWindow(const Dataset& dataset, const TruthOfFrames& truth, const Part& part,
                    const SlamResult& result);

}  // namespace deepuav
