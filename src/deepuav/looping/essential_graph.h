#pragma once

#include <map>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/poses/pose_graph.h"
#include "deepuav/map/map.h"
#include "deepuav/map/map_correction.h"

namespace deepuav {

struct EssentialGraphOptions {
  int min_shared_landmarks = 100;  ///< Of two covisible keyframes for an edge between them.
  double loop_weight = 10;         ///< Of an edge that closes the loop; the others have 1.
  PoseGraphOptions pose_graph;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_shared_landmarks", min_shared_landmarks, "",
          "of two covisible keyframes for an edge between them", Between(1, 1'000'000));
    visit("loop_weight", loop_weight, "", "of an edge that closes the loop; the others have 1",
          Above(0, 1e6));
    visit.Part("pose_graph", pose_graph);
  }
};

/// Spreads the error of a loop over the map: the relative poses along the spanning tree, earlier
/// loops and strong covisibility are kept as far as the new one allows (Mur-Artal 2015, section
/// VII-D). `moved`: how the world moves around the keyframes at the loop's newer end, which every
/// tie belongs to. The root stays. Returns how the world moves around every keyframe.
std::vector<KeyframeMove> OptimiseEssentialGraph(const Map& map,
                                                 const std::map<KeyframeId, Sim3>& moved,
                                                 const std::vector<LoopTie>& ties,
                                                 const EssentialGraphOptions& options);

}  // namespace deepuav
