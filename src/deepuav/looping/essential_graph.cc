#include "deepuav/looping/essential_graph.h"

#include <algorithm>
#include <set>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

/// The graph and which keyframe each node is.
struct EssentialGraph {
  PoseGraph graph;
  std::vector<KeyframeId> keyframes;
  std::map<KeyframeId, int> node_of;

  void AddEdge(KeyframeId a, KeyframeId b, const Sim3& a_from_b, double weight) {
    graph.edges.push_back({node_of.at(a), node_of.at(b), a_from_b, weight});
  }
};

void AddNodes(const Map& map, const std::map<KeyframeId, Sim3>& moved, EssentialGraph* essential) {
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    essential->node_of[keyframe.id] = static_cast<int>(essential->keyframes.size());
    essential->keyframes.push_back(keyframe.id);
    const bool is_root = keyframe.id == map.root();
    const auto move = is_root ? moved.end() : moved.find(keyframe.id);
    const Sim3 cam_from_old(keyframe.cam_from_world);
    essential->graph.node_from_world.push_back(
        move == moved.end() ? cam_from_old : cam_from_old * move->second.Inverse());
    essential->graph.fixed.push_back(is_root);
  });
}

/// Relations within the map as it is.
void AddOldEdges(const Map& map, int min_shared, EssentialGraph* essential) {
  std::set<std::pair<KeyframeId, KeyframeId>> related;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    const auto relate = [&](KeyframeId other) {
      related.insert({std::min(keyframe.id, other), std::max(keyframe.id, other)});
    };
    if (keyframe.parent.valid()) relate(keyframe.parent);
    for (KeyframeId other : keyframe.loops) relate(other);
    for (const auto& [other, shared] : keyframe.covisible) {
      if (shared >= min_shared) relate(other);
    }
  });
  for (const auto& [a, b] : related) {
    const SE3 a_from_b = map.At(a).cam_from_world * map.At(b).cam_from_world.Inverse();
    essential->AddEdge(a, b, Sim3(a_from_b), 1);
  }
}

void AddLoopEdges(const Map& map, const std::map<KeyframeId, Sim3>& moved,
                  const std::vector<LoopTie>& ties, double weight, EssentialGraph* essential) {
  for (const LoopTie& tie : ties) {
    const Sim3 cam_from_new =
        Sim3(map.At(tie.keyframe).cam_from_world) * moved.at(tie.keyframe).Inverse();
    const Sim3 world_from_place(map.At(tie.place).cam_from_world.Inverse());
    essential->AddEdge(tie.keyframe, tie.place, cam_from_new * world_from_place, weight);
  }
}

}  // namespace

void EssentialGraphOptions::Check() const { CheckOptions("looping.essential_graph", *this); }

std::vector<KeyframeMove> OptimiseEssentialGraph(const Map& map,
                                                 const std::map<KeyframeId, Sim3>& moved,
                                                 const std::vector<LoopTie>& ties,
                                                 const EssentialGraphOptions& options) {
  EssentialGraph essential;
  AddNodes(map, moved, &essential);
  AddOldEdges(map, options.min_shared_landmarks, &essential);
  AddLoopEdges(map, moved, ties, options.loop_weight, &essential);
  const double depth = map.MedianDepth(ties.back().place);
  if (depth > 0) essential.graph.unit_length = depth;
  OptimisePoseGraph(&essential.graph, options.pose_graph);

  std::vector<KeyframeMove> moves;
  for (size_t node = 0; node < essential.keyframes.size(); ++node) {
    const KeyframeId id = essential.keyframes[node];
    const Sim3 new_world_from_cam = essential.graph.node_from_world[node].Inverse();
    moves.push_back({id, new_world_from_cam * Sim3(map.At(id).cam_from_world)});
  }
  return moves;
}

}  // namespace deepuav
