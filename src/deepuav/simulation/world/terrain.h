#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/simulation/world/road_network.h"
#include "deepuav/simulation/world/scene_options.h"
#include "deepuav/simulation/world/water.h"

namespace deepuav {

/// Heights on a square grid, as triangles. Beyond its border the land goes on as in a mirror, in
/// cells that grow, so that the horizon is not the edge of the world.
class Terrain {
 public:
  /// `roads` are banked up where they cross water. With a DEM in the options, water and roads are
  /// left out.
  Terrain(const SceneOptions& options, const Water& water, const RoadNetwork& roads);

  /// On the triangles of the grid. Outside: that of the nearest place inside.
  double Height(double x, double y) const;

  /// The smooth normal, which shading uses.
  Eigen::Vector3f Normal(float x, float y) const;

  /// The place inside the grid that the mirrored land outside is a copy of; (x, y) itself inside.
  Eigen::Vector2f Mirrored(float x, float y) const;

  double half_extent_m() const { return half_extent_; }

  /// The triangles to trace, mirrored land included.
  struct Mesh {
    std::vector<Eigen::Vector3f> vertices;
    std::vector<Eigen::Vector3<uint32_t>> triangles;
  };
  Mesh MakeMesh() const;

 private:
  double& HeightAt(int x, int y) { return heights_[static_cast<size_t>(y) * side_ + x]; }
  double HeightAt(int x, int y) const { return heights_[static_cast<size_t>(y) * side_ + x]; }
  void FillProcedural(const SceneOptions& options, const Water& water, const RoadNetwork& roads);
  void FillFromImage(const SceneOptions& options);
  void ComputeNormals();

  double half_extent_, cell_;
  int side_;  // Vertices along one side.
  std::vector<double> heights_;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace deepuav
