#include "deepuav/simulation/world/face_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

namespace deepuav {
namespace {

using Eigen::Vector3f;

constexpr FaceMesh::Look kLook{Finish::kPaint, 0.4f, 17};

Vector3f NormalOf(const FaceMesh& mesh, size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return (mesh.vertices[t[1]] - mesh.vertices[t[0]])
      .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
}
Vector3f MiddleOf(const FaceMesh& mesh, size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
}

/// Every triangle has a face, and corners that there are.
void ExpectWhole(const FaceMesh& mesh) {
  ASSERT_EQ(mesh.face_of_triangle.size(), mesh.triangles.size());
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    ASSERT_LT(mesh.triangles[i].maxCoeff(), mesh.vertices.size());
    ASSERT_LT(mesh.face_of_triangle[i], mesh.faces.size());
  }
}

TEST(FaceMeshQuad, HasCoordinatesOfItsOwnInMetres) {
  FaceMesh mesh;
  const Vector3f a(1, 2, 3), along(0, 3, 0), up(0.5f, 0, 2);
  mesh.AddTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, kLook);  // Others do not matter.
  mesh.AddQuad(a, a + along, a + along + up, a + up, kLook);
  ExpectWhole(mesh);
  ASSERT_EQ(mesh.triangles.size(), 3u);
  const Face& face = mesh.faces[1];
  EXPECT_EQ(mesh.face_of_triangle[1], 1u);
  EXPECT_EQ(mesh.face_of_triangle[2], 1u);
  EXPECT_EQ(face.origin, a);
  EXPECT_NEAR(face.width_m, 3, 1e-6);
  EXPECT_NEAR(face.height_m, up.norm(), 1e-6);
  EXPECT_NEAR(face.u_axis.dot(face.v_axis), 0, 1e-6);
  EXPECT_TRUE((face.origin + face.width_m * face.u_axis + face.height_m * face.v_axis)
                  .isApprox(a + along + up));
  // Both halves face the same way, and make up the whole.
  EXPECT_GT(NormalOf(mesh, 1).dot(NormalOf(mesh, 2)), 0);
  EXPECT_NEAR((NormalOf(mesh, 1) + NormalOf(mesh, 2)).norm() / 2, along.cross(up).norm(), 1e-5);
  EXPECT_EQ(face.seed, 17u);
}

TEST(FaceMeshQuad, ThatLeansStillHasItsAxesAtRightAngles) {
  FaceMesh mesh;
  mesh.AddQuad({0, 0, 0}, {4, 0, 0}, {6, 2, 0}, {2, 2, 0}, kLook);
  EXPECT_TRUE(mesh.faces[0].v_axis.isApprox(Vector3f::UnitY()));
  EXPECT_NEAR(mesh.faces[0].height_m, 2, 1e-6);
}

TEST(FaceMeshBox, FacesOutwardsAllRoundAndOnTop) {
  for (const float angle : {0.0f, 0.7f, 2.5f}) {
    FaceMesh mesh;
    const Vector3f base(5, -3, 1), along(std::cos(angle), std::sin(angle), 0);
    mesh.AddBox({base, along, 4, 2, 3}, kLook, {Finish::kMetalRoof, 0.2f, 3});
    ExpectWhole(mesh);
    ASSERT_EQ(mesh.faces.size(), 5u);
    const Vector3f middle = base + Vector3f(0, 0, 1.5f);
    Vector3f sum = Vector3f::Zero();
    float area = 0, volume = 0;
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
      const Vector3f normal = NormalOf(mesh, i) / 2;
      EXPECT_GT(normal.dot(MiddleOf(mesh, i) - middle), 0) << i;
      sum += normal;
      area += normal.norm();
      volume += normal.dot(MiddleOf(mesh, i) - base) / 3;
    }
    EXPECT_NEAR(area, 2 * 3 * (4 + 2) + 4 * 2, 1e-4);
    EXPECT_NEAR(volume, 4 * 2 * 3, 1e-3);  // The underside would lie in the plane of the base.
    EXPECT_LT((sum - Vector3f(0, 0, 8)).norm(), 1e-4);  // What closes it is missing below.
    EXPECT_EQ(mesh.faces.back().finish, Finish::kMetalRoof);
    EXPECT_NE(mesh.faces[0].seed, mesh.faces[1].seed);
  }
}

TEST(FaceMeshBall, IsClosedRoundAndFacesOutwards) {
  for (const int subdivisions : {0, 1, 3}) {
    FaceMesh mesh;
    const Vector3f centre(1, 2, 3), radii(2, 1, 0.5f);
    mesh.AddTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, kLook);
    mesh.AddBall({centre, radii, subdivisions, 0}, kLook);
    ExpectWhole(mesh);
    ASSERT_EQ(mesh.triangles.size(), 1u + (20u << (2 * subdivisions)));
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    float volume = 0;
    for (size_t i = 1; i < mesh.triangles.size(); ++i) {
      EXPECT_EQ(mesh.face_of_triangle[i], 1u);
      const auto& t = mesh.triangles[i];
      for (int k = 0; k < 3; ++k) {
        ++edges[{t[k], t[(k + 1) % 3]}];
        ASSERT_NEAR((mesh.vertices[t[k]] - centre).cwiseQuotient(radii).norm(), 1, 1e-5);
      }
      const Vector3f normal = NormalOf(mesh, i);
      ASSERT_GT(normal.dot(MiddleOf(mesh, i) - centre), 0);
      volume += normal.dot(MiddleOf(mesh, i) - centre) / 6;
    }
    // Closed: each edge is run along once in either sense.
    for (const auto& [edge, times] : edges) {
      ASSERT_EQ(times, 1);
      ASSERT_TRUE(edges.contains({edge.second, edge.first}));
    }
    const auto ellipsoid = static_cast<float>(4 * M_PI / 3 * radii.prod());
    EXPECT_LT(volume, ellipsoid);
    EXPECT_GT(volume, (subdivisions == 3 ? 0.98f : 0.6f) * ellipsoid);
  }
}

TEST(FaceMeshBall, IsAsRoughAsAskedAndFollowsFromItsSeed) {
  const auto made = [](float roughness, uint32_t seed) {
    FaceMesh mesh;
    mesh.AddBall({Vector3f::Zero(), {1, 1, 1}, 3, roughness}, {Finish::kRock, 0.3f, seed});
    return mesh.vertices;
  };
  const auto smooth = made(0, 1), rough = made(0.3f, 1), other = made(0.3f, 2);
  float least = 9, most = 0;
  for (const Vector3f& vertex : rough) {
    least = std::min(least, vertex.norm());
    most = std::max(most, vertex.norm());
  }
  EXPECT_GT(least, 0.7f - 0.3f);
  EXPECT_LT(most, 1.3f + 0.3f);
  EXPECT_GT(most - least, 0.1f);
  EXPECT_EQ(rough, made(0.3f, 1));
  EXPECT_NE(rough, other);
  EXPECT_EQ(smooth.size(), rough.size());
}

}  // namespace
}  // namespace deepuav
