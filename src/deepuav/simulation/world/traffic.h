#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/simulation/world/face_mesh.h"
#include "deepuav/simulation/world/road_network.h"
#include "deepuav/simulation/world/terrain.h"

namespace deepuav {

/// A rotation and a translation in single precision: p_world = matrix * [p_object; 1].
using Placement = Eigen::Matrix<float, 3, 4>;

/// Cars, lorries and people on the roads. Where each is follows from the time alone.
class Traffic {
 public:
  Traffic(const SceneOptions& options, const RoadNetwork& roads, const Terrain& terrain);

  struct Mover {
    int prototype;
    uint32_t seed;  ///< Of its looks.
    int road;
    float lane_m;      ///< To the left of the road's middle line.
    double speed_m_s;  ///< Along the line; negative: against it.
    double start_m;    ///< Along the line at time 0.
  };

  static std::vector<FaceMesh> MakePrototypes();

  const std::vector<Mover>& movers() const { return movers_; }

  /// x forward, y left, z up from the ground. Who comes to the end of the road begins again at its
  /// start.
  Placement PlacementAt(const Mover& mover, double time_s) const;

  /// Whether a mover jumps back to the road's start between two times.
  bool Jumps(const Mover& mover, double from_s, double to_s) const;

 private:
  /// How far the mover is along its road's line, all laps together.
  double TravelOf(const Mover& mover, double time_s) const;
  double LapOf(const Mover& mover, double time_s) const;

  const RoadNetwork& roads_;
  const Terrain& terrain_;
  double stop_s_, stands_s_;
  std::vector<Mover> movers_;
};

}  // namespace deepuav
