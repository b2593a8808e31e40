#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace deepuav {

/// How a face looks. Faces carry their own flat coordinates in metres.
enum class Finish : uint8_t {
  kPlasterWall,  ///< With windows, as the other two walls.
  kBrickWall,
  kConcreteWall,
  kBlankWall,  ///< Gables, chimneys, parapets.
  kTiledRoof,
  kFlatRoof,
  kMetalRoof,
  kSolarPanels,
  kPrint,  ///< Posters, labels, lorries' sides.
  kPlanks,
  kPaint,  ///< Car bodies.
  kGlass,
  kDark,  ///< Tyres, openings.
  kCloth,
  kHallFloor,
  kHallWall,
  kLeaves,  ///< Read by position in the mesh, not by flat coordinates; as are the next three.
  kBark,
  kRock,
  kStraw,
  kGlow,  ///< Of test markers and lamps: shines by itself.
};

struct Face {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector3f u_axis = Eigen::Vector3f::UnitX();
  Eigen::Vector3f v_axis = Eigen::Vector3f::UnitY();
  float width_m = 1, height_m = 1;
  Finish finish = Finish::kBlankWall;
  float tone = 0.5f;  ///< Albedo.
  uint32_t seed = 0;
};

/// Triangles with the face that each belongs to.
struct FaceMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3<uint32_t>> triangles;
  std::vector<uint32_t> face_of_triangle;
  std::vector<Face> faces;

  /// How a face added next looks.
  struct Look {
    Finish finish;
    float tone;
    uint32_t seed;
  };

  /// A flat quadrilateral; u runs from a to b, v at right angles to it towards d.
  void AddQuad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
               const Eigen::Vector3f& d, const Look& look);
  void AddTriangle(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
                   const Look& look);

  /// A box about the vertical through `base`, its sides along `along` (horizontal, unit) and
  /// across. The underside is left out.
  struct BoxShape {
    Eigen::Vector3f base;  ///< Middle of the underside.
    Eigen::Vector3f along;
    float length, width, height;
  };
  void AddBox(const BoxShape& box, const Look& sides, const Look& top);

  /// A sphere of `subdivisions`-fold split icosahedron faces. Its points are moved in or out by up
  /// to `roughness` of the radius by noise of `seed`.
  struct BallShape {
    Eigen::Vector3f centre;
    Eigen::Vector3f radii;
    int subdivisions;
    float roughness;
  };
  void AddBall(const BallShape& ball, const Look& look);
};

}  // namespace deepuav
