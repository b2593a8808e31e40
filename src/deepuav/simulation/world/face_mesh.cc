#include "deepuav/simulation/world/face_mesh.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector3f;
using Triangle = Eigen::Vector3<uint32_t>;

Face MakeFace(const Vector3f& a, const Vector3f& b, const Vector3f& far,
              const FaceMesh::Look& look) {
  Face face;
  face.origin = a;
  face.u_axis = (b - a).normalized();
  const Vector3f up = (far - a) - face.u_axis.dot(far - a) * face.u_axis;
  face.v_axis = up.normalized();
  face.width_m = (b - a).norm();
  face.height_m = up.norm();
  face.finish = look.finish;
  face.tone = look.tone;
  face.seed = look.seed;
  return face;
}

struct Sphere {
  std::vector<Vector3f> points;
  std::vector<Triangle> triangles;
};

Sphere Icosahedron() {
  constexpr float kGolden = 1.6180340f;
  Sphere sphere;
  for (const float s : {-1.0f, 1.0f}) {
    for (const float g : {-kGolden, kGolden}) {
      sphere.points.push_back(Vector3f(0, s, g).normalized());
      sphere.points.push_back(Vector3f(s, g, 0).normalized());
      sphere.points.push_back(Vector3f(g, 0, s).normalized());
    }
  }
  // All triples of neighbours: the edge of the unit icosahedron is 1.0515 long.
  const auto near = [&](uint32_t i, uint32_t j) {
    return (sphere.points[i] - sphere.points[j]).norm() < 1.1f;
  };
  for (uint32_t i = 0; i < 12; ++i) {
    for (uint32_t j = i + 1; j < 12; ++j) {
      for (uint32_t k = j + 1; k < 12; ++k) {
        if (!near(i, j) || !near(j, k) || !near(i, k)) continue;
        const Vector3f& a = sphere.points[i];
        const bool outward = a.dot(sphere.points[j].cross(sphere.points[k])) > 0;
        sphere.triangles.push_back(outward ? Triangle(i, j, k) : Triangle(i, k, j));
      }
    }
  }
  return sphere;
}

Sphere Subdivided(const Sphere& coarse) {
  Sphere fine{coarse.points, {}};
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
  const auto middle = [&](uint32_t a, uint32_t b) {
    const auto [at, is_new] =
        middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(fine.points.size()));
    if (is_new) fine.points.push_back((fine.points[a] + fine.points[b]).normalized());
    return at->second;
  };
  for (const Triangle& t : coarse.triangles) {
    const uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
    fine.triangles.insert(fine.triangles.end(), {Triangle(t[0], ab, ca), Triangle(ab, t[1], bc),
                                                 Triangle(ca, bc, t[2]), Triangle(ab, bc, ca)});
  }
  return fine;
}

}  // namespace

void FaceMesh::AddQuad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d,
                       const Look& look) {
  const auto first = static_cast<uint32_t>(vertices.size());
  vertices.insert(vertices.end(), {a, b, c, d});
  triangles.insert(triangles.end(),
                   {Triangle(first, first + 1, first + 2), Triangle(first, first + 2, first + 3)});
  face_of_triangle.insert(face_of_triangle.end(), 2, static_cast<uint32_t>(faces.size()));
  faces.push_back(MakeFace(a, b, d, look));
}

void FaceMesh::AddTriangle(const Vector3f& a, const Vector3f& b, const Vector3f& c,
                           const Look& look) {
  const auto first = static_cast<uint32_t>(vertices.size());
  vertices.insert(vertices.end(), {a, b, c});
  triangles.emplace_back(first, first + 1, first + 2);
  face_of_triangle.push_back(static_cast<uint32_t>(faces.size()));
  faces.push_back(MakeFace(a, b, c, look));
}

void FaceMesh::AddBox(const BoxShape& box, const Look& sides, const Look& top) {
  const Vector3f across(-box.along.y(), box.along.x(), 0);
  const Vector3f l = box.length / 2 * box.along, w = box.width / 2 * across;
  const Vector3f up(0, 0, box.height);
  const std::array<Vector3f, 4> corners = {box.base - l - w, box.base + l - w, box.base + l + w,
                                           box.base - l + w};
  for (size_t i = 0; i < 4; ++i) {
    const Vector3f& a = corners[i];
    const Vector3f& b = corners[(i + 1) % 4];
    AddQuad(a, b, b + up, a + up,
            {sides.finish, sides.tone, HashCell(static_cast<int32_t>(i), 0, sides.seed)});
  }
  AddQuad(corners[0] + up, corners[1] + up, corners[2] + up, corners[3] + up, top);
}

void FaceMesh::AddBall(const BallShape& ball, const Look& look) {
  Sphere sphere = Icosahedron();
  for (int i = 0; i < ball.subdivisions; ++i) sphere = Subdivided(sphere);
  const auto first = static_cast<uint32_t>(vertices.size());
  for (const Vector3f& point : sphere.points) {
    const float swell = 0.6f * GradientNoise(Vector3f(2.1f * point), look.seed) +
                        0.55f * GradientNoise(Vector3f(5.3f * point), look.seed + 1) +
                        0.45f * GradientNoise(Vector3f(9.7f * point), look.seed + 2);
    vertices.push_back(ball.centre + (1 + ball.roughness * swell) * point.cwiseProduct(ball.radii));
  }
  for (const Triangle& triangle : sphere.triangles) {
    triangles.push_back(triangle + Triangle::Constant(first));
  }
  face_of_triangle.insert(face_of_triangle.end(), sphere.triangles.size(),
                          static_cast<uint32_t>(faces.size()));
  Face face;
  face.origin = ball.centre;
  face.width_m = face.height_m = 2 * ball.radii.maxCoeff();
  face.finish = look.finish;
  face.tone = look.tone;
  face.seed = look.seed;
  faces.push_back(face);
}

}  // namespace deepuav
