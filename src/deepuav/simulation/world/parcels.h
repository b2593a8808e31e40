#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "deepuav/simulation/world/scene_options.h"

namespace deepuav {

enum class ParcelKind {
  kMeadow,
  kCrop,   ///< Rows of green plants on bare soil.
  kWheat,  ///< Even, with the tracks of tractors.
  kPloughed,
  kStubble,  ///< Straw in swathes.
  kPlain,    ///< Nearly without texture.
  kForest,
  kOrchard,  ///< Trees in rows.
  kGarden,   ///< A plot with a house.
  kSquare,   ///< A paved plot.
  kSand,
  kScrub,
};

/// A piece of land with one use: a field or a plot.
struct Parcel {
  std::vector<Eigen::Vector2d>
      corners;  ///< Anticlockwise, convex but for the bend of the borders, m.
  Eigen::Vector2d centre;
  Eigen::Vector2d along;       ///< Unit vector of the rows, and of the house's ridge.
  double length_m, breadth_m;  ///< Along and across.
  ParcelKind kind;
  float tone;  ///< 0.75 to 1.25.
  uint32_t seed;
  bool in_town;
};

enum class RoadClass { kTrack, kStreet, kHighway };

/// The straight border, before it is bent, along which a road runs.
struct RoadSite {
  std::vector<Eigen::Vector2d> points;  ///< World, m.
  RoadClass road_class;
};

/// Divides the land into parcels by recursive splits along lines, which a smooth displacement of
/// the plane then bends.
class ParcelMap {
 public:
  explicit ParcelMap(const SceneOptions& options);

  struct Place {
    const Parcel* parcel;
    float border_m;  ///< Distance to the nearest border.
  };
  Place Find(float x, float y) const;

  const std::vector<Parcel>& parcels() const { return parcels_; }
  const std::vector<RoadSite>& road_sites() const { return road_sites_; }

 private:
  struct Node {
    Eigen::Vector2f normal;
    float offset = 0;
    int children[2] = {-1, -1};  // Below and above; negative: ~parcel.
  };
  struct Builder;

  Eigen::Vector2f Bend(const Eigen::Vector2f& point) const;
  Eigen::Vector2d Unbend(const Eigen::Vector2d& bent) const;

  void FillBends(const SceneOptions& options);

  // The displacement on a grid about the middle, read between its points.
  float bend_m_;
  float bends_reach_m_ = 0;
  int bends_side_ = 0;
  std::vector<Eigen::Vector2f> bends_;
  std::vector<Node> nodes_;
  std::vector<Parcel> parcels_;
  std::vector<RoadSite> road_sites_;
  int root_ = 0;
};

}  // namespace deepuav
