#include "deepuav/simulation/world/hall.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector3f;

constexpr float kCeilingM = 8;
constexpr float kBayM = 8;  // Between pillars, and between strips of light.

class Builder {
 public:
  explicit Builder(const SceneOptions& options)
      : random_(HashCell(options.seed, 7, 0x4a11u)),
        half_x_(static_cast<float>(options.extent_m / 2)),
        half_y_(static_cast<float>(options.extent_m * 0.32)) {}

  Hall Build() {
    AddFloorAndWalls();
    AddRoof();
    AddPosters();
    AddPillars();
    AddShelves();
    AddClutter();
    return {std::move(mesh_), {half_x_, half_y_}, kCeilingM};
  }

 private:
  float Within(double low, double high) { return static_cast<float>(random_.Uniform(low, high)); }
  uint32_t Seed() { return static_cast<uint32_t>(random_.Index(1 << 30)); }
  FaceMesh::Look Plain(float tone) { return {Finish::kBlankWall, tone, Seed()}; }

  void AddFloorAndWalls() {
    const float x = half_x_, y = half_y_, z = kCeilingM;
    mesh_.AddQuad({-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}, {Finish::kHallFloor, 0.3f, 1});
    const FaceMesh::Look wall{Finish::kHallWall, 0.5f, 2};
    mesh_.AddQuad({-x, -y, 0}, {x, -y, 0}, {x, -y, z}, {-x, -y, z}, wall);
    mesh_.AddQuad({x, -y, 0}, {x, y, 0}, {x, y, z}, {x, -y, z}, wall);
    mesh_.AddQuad({x, y, 0}, {-x, y, 0}, {-x, y, z}, {x, y, z}, wall);
    mesh_.AddQuad({-x, y, 0}, {-x, -y, 0}, {-x, -y, z}, {-x, y, z}, wall);
  }

  // Panels with an open strip in every bay, over beams.
  void AddRoof() {
    constexpr float kStripM = 1.4f;
    for (float x = -half_x_; x < half_x_ - 0.1f; x += kBayM) {
      const float low = x + kStripM, high = std::min(x + kBayM, half_x_);
      if (low < high) {
        mesh_.AddQuad({low, -half_y_, kCeilingM}, {high, -half_y_, kCeilingM},
                      {high, half_y_, kCeilingM}, {low, half_y_, kCeilingM},
                      {Finish::kMetalRoof, 0.4f, Seed()});
      }
      mesh_.AddBox({{low + 0.3f, 0, kCeilingM - 0.5f}, Vector3f::UnitX(), 0.3f, 2 * half_y_, 0.45f},
                   Plain(0.35f), Plain(0.35f));
      mesh_.AddQuad({low + 0.15f, half_y_, kCeilingM - 0.5f},
                    {low + 0.15f, -half_y_, kCeilingM - 0.5f},
                    {low + 0.45f, -half_y_, kCeilingM - 0.5f},
                    {low + 0.45f, half_y_, kCeilingM - 0.5f}, Plain(0.3f));
    }
  }

  // A poster on the wall through `foot` with the unit direction `right` along it, seen from inside.
  void AddPoster(const Vector3f& foot, const Vector3f& right) {
    const float width = Within(1, 3.2), height = Within(0.8, 2.6), up = Within(0.5, 4.5);
    const Vector3f a = foot + up * Vector3f::UnitZ(), b = a + width * right;
    const Vector3f rise = height * Vector3f::UnitZ();
    mesh_.AddQuad(a, b, b + rise, a + rise, {Finish::kPrint, 0.5f, Seed()});
  }

  void AddPosters() {
    constexpr float kInsideM = 0.03f;
    for (float x = -half_x_ + 1; x < half_x_ - 3; x += Within(1.6, 3.6)) {
      AddPoster({x, half_y_ - kInsideM, 0}, Vector3f::UnitX());
      AddPoster({-x, -half_y_ + kInsideM, 0}, -Vector3f::UnitX());
    }
    for (float y = -half_y_ + 1; y < half_y_ - 3; y += Within(1.6, 3.6)) {
      AddPoster({-half_x_ + kInsideM, y, 0}, Vector3f::UnitY());
      AddPoster({half_x_ - kInsideM, -y, 0}, -Vector3f::UnitY());
    }
  }

  void AddPillars() {
    for (float x = -half_x_ + kBayM; x < half_x_ - 1; x += kBayM) {
      for (const float y : {-0.62f * half_y_, 0.62f * half_y_}) {
        mesh_.AddBox({{x, y, 0}, Vector3f::UnitX(), 0.5f, 0.5f, kCeilingM - 0.5f},
                     {Finish::kHallWall, 0.38f, Seed()}, Plain(0.4f));
        mesh_.AddBox({{x, y, 0}, Vector3f::UnitX(), 0.56f, 0.56f, 1.1f},
                     {Finish::kPrint, 0.5f, Seed()}, Plain(0.4f));
      }
    }
  }

  void AddShelf(const Vector3f& foot, float length) {
    constexpr float kDepthM = 1.1f, kLevelM = 1.3f;
    constexpr int kLevels = 3;
    const float height = kLevels * kLevelM;
    for (const float end : {-length / 2, 0.0f, length / 2}) {
      for (const float side : {-kDepthM / 2, kDepthM / 2}) {
        mesh_.AddBox({foot + Vector3f(end, side, 0), Vector3f::UnitX(), 0.1f, 0.1f, height + 0.3f},
                     {Finish::kPaint, 0.25f, 5}, {Finish::kPaint, 0.25f, 5});
      }
    }
    for (int level = 0; level <= kLevels; ++level) {
      const float z = 0.12f + kLevelM * static_cast<float>(level);
      mesh_.AddBox({foot + Vector3f(0, 0, z - 0.08f), Vector3f::UnitX(), length, kDepthM, 0.08f},
                   {Finish::kPlanks, 0.3f, Seed()}, {Finish::kPlanks, 0.35f, Seed()});
      for (float x = -length / 2 + 0.2f; x < length / 2 - 0.9f;) {
        const float width = Within(0.4, 1.0);
        if (random_.Index(5) != 0) {
          AddCrate(foot + Vector3f(x + width / 2, Within(-0.1, 0.1), z), width, Within(0.6, 0.95));
        }
        x += width + Within(0.05, 0.3);
      }
    }
  }

  void AddCrate(const Vector3f& base, float length, float width) {
    const bool printed = random_.Index(3) == 0;
    const float tone = Within(0.2, 0.6);
    const FaceMesh::Look sides{printed ? Finish::kPrint : Finish::kBlankWall, tone, Seed()};
    mesh_.AddBox({base, Vector3f::UnitX(), length, width, Within(0.35, 1.0)}, sides,
                 {Finish::kPlanks, 0.9f * tone, Seed()});
  }

  void AddShelves() {
    for (const float y : {-0.8f * half_y_, -0.4f * half_y_, 0.4f * half_y_, 0.8f * half_y_}) {
      for (float x = -half_x_ + 5; x < half_x_ - 5; x += kBayM) {
        if (random_.Index(4) != 0) AddShelf({x, y, 0}, 5.5f);
      }
    }
  }

  // Pallets and boxes on the floor, low, along the aisle in the middle.
  void AddClutter() {
    for (float x = -half_x_ + 2; x < half_x_ - 2; x += Within(2, 5)) {
      const float side = random_.Index(2) == 0 ? -1.0f : 1.0f;
      AddCrate({x, side * Within(0.12, 0.25) * half_y_, 0}, Within(0.8, 1.3), Within(0.8, 1.2));
    }
  }

  Random random_;
  float half_x_, half_y_;
  FaceMesh mesh_;
};

}  // namespace

Hall MakeHall(const SceneOptions& options) { return Builder(options).Build(); }

}  // namespace deepuav
