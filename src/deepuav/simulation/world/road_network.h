#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/simulation/world/parcels.h"

namespace deepuav {

struct Road {
  std::vector<Eigen::Vector2d> points;  ///< Middle line, m.
  std::vector<double> arc_m;            ///< Length of the line up to each point.
  RoadClass road_class;
  float half_width_m;

  double length_m() const { return arc_m.back(); }
};

/// Splits a line of points into a road, with its arc lengths.
Road MakeRoad(const RoadSite& site);

class RoadNetwork {
 public:
  /// Pieces of the sites outside the square |x|, |y| < half_extent_m, or for which `blocked` holds,
  /// are cut off. Roads are kept in order of length, longest first.
  template <typename Blocked>
  RoadNetwork(const std::vector<RoadSite>& sites, double half_extent_m, const Blocked& blocked)
      : half_extent_m_(half_extent_m) {
    for (const RoadSite& site : sites) {
      RoadSite piece{{}, site.road_class};
      for (const Eigen::Vector2d& point : site.points) {
        if (point.cwiseAbs().maxCoeff() < half_extent_m && !blocked(point)) {
          piece.points.push_back(point);
        } else {
          AddPiece(&piece);
        }
      }
      AddPiece(&piece);
    }
    BuildIndex();
  }

  /// How far beyond a road's edge Find still tells of it.
  static constexpr float kVergeM = 5;

  struct Place {
    const Road* road = nullptr;  ///< The road whose edge is nearest; null beyond kVergeM of any.
    float across_m = 0;          ///< From the middle line, to the left positive.
    float along_m = 0;
    float edge_m = 1e9f;    ///< From the road's edge, negative inside.
    bool junction = false;  ///< On another road too.
  };
  Place Find(float x, float y) const;

  const std::vector<Road>& roads() const { return roads_; }

 private:
  struct Segment {
    Eigen::Vector2f start, direction;
    float length, arc;
    int road;
  };

  void AddPiece(RoadSite* piece);
  void BuildIndex();

  double half_extent_m_;
  std::vector<Road> roads_;
  std::vector<Segment> segments_;
  int cells_ = 0;
  std::vector<int> cell_begin_;  // Into cell_segments_, one more than there are cells.
  std::vector<int> cell_segments_;
};

}  // namespace deepuav
