#include "deepuav/simulation/world/parcels.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2f;

constexpr float kBendLength = 260, kBendCellM = 8;
constexpr double kPlotDepthM = 21;
constexpr int kUnbendIterations = 25;

struct Box {
  Vector2d along;  // Of the longer side.
  double length, breadth;
};

// The polygon's extent along and across its longest side.
Box BoxOf(const std::vector<Vector2d>& polygon) {
  Vector2d longest = Vector2d::Zero();
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (side.squaredNorm() > longest.squaredNorm()) longest = side;
  }
  const Vector2d along = longest.normalized(), across(-along.y(), along.x());
  const auto extent = [&](const Vector2d& direction) {
    double low = polygon[0].dot(direction), high = low;
    for (const Vector2d& corner : polygon) {
      low = std::min(low, corner.dot(direction));
      high = std::max(high, corner.dot(direction));
    }
    return high - low;
  };
  const double length = extent(along), breadth = extent(across);
  if (length >= breadth) return {along, length, breadth};
  return {across, breadth, length};
}

Vector2d Centre(const std::vector<Vector2d>& polygon) {
  Vector2d sum = Vector2d::Zero();
  double area = 0;
  for (size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Vector2d a = polygon[i] - polygon[0], b = polygon[i + 1] - polygon[0];
    const double cross = a.x() * b.y() - a.y() * b.x();
    area += cross;
    sum += cross * (a + b) / 3;
  }
  return area > 0 ? Vector2d(polygon[0] + sum / area) : polygon[0];
}

struct Halves {
  std::vector<Vector2d> below, above, border;
};

Halves Split(const std::vector<Vector2d>& polygon, const Vector2d& normal, double offset) {
  Halves halves;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    const double da = a.dot(normal) - offset, db = b.dot(normal) - offset;
    (da < 0 ? halves.below : halves.above).push_back(a);
    if ((da < 0) != (db < 0)) {
      const Vector2d crossing = a + da / (da - db) * (b - a);
      halves.below.push_back(crossing);
      halves.above.push_back(crossing);
      halves.border.push_back(crossing);
    }
  }
  return halves;
}

ParcelKind KindOfField(const SceneOptions& options, Random* random) {
  if (random->Uniform(0, 1) < options.forest_fraction) return ParcelKind::kForest;
  if (random->Uniform(0, 1) < options.aridity) {
    return random->Uniform(0, 1) < 0.45 ? ParcelKind::kSand : ParcelKind::kScrub;
  }
  static constexpr ParcelKind kFields[] = {
      ParcelKind::kMeadow, ParcelKind::kMeadow,   ParcelKind::kCrop,    ParcelKind::kCrop,
      ParcelKind::kWheat,  ParcelKind::kPloughed, ParcelKind::kStubble, ParcelKind::kOrchard,
      ParcelKind::kWheat,  ParcelKind::kPlain,
  };
  return kFields[random->Index(static_cast<int>(std::size(kFields)))];
}

}  // namespace

struct ParcelMap::Builder {
  const SceneOptions& options;
  ParcelMap& map;
  Random random;

  bool InTown(const Vector2d& centre) const { return centre.norm() < options.town_radius_m; }

  int Build(const std::vector<Vector2d>& polygon) {
    const Box box = BoxOf(polygon);
    const Vector2d centre = Centre(polygon);
    const bool town = InTown(centre);
    // Land on the edge of town is split until it is clear what belongs to it.
    const bool edge = centre.norm() < options.town_radius_m + box.length / 2;
    const double target = town ? kPlotDepthM + 2 * options.storeys : options.parcel_m;
    const double limit = edge && !town ? std::min(target, options.parcel_m / 2) : target;
    if (box.length < 1.5 * limit && box.length * box.breadth < 1.6 * limit * limit) {
      return MakeParcel(polygon, box, centre, town);
    }

    const double jitter = random.Gaussian(town ? 0.04 : 0.13);
    const Vector2d normal = Eigen::Rotation2Dd(jitter) * box.along;
    const double place = (town ? 0.1 : 0.16) * random.Uniform(-1, 1) * box.length;
    const double offset = centre.dot(normal) + place;
    const Halves halves = Split(polygon, normal, offset);
    AddRoad(halves.border, box, town || edge);

    const int index = static_cast<int>(map.nodes_.size());
    map.nodes_.push_back({normal.cast<float>(), static_cast<float>(offset), {-1, -1}});
    const int below = Build(halves.below), above = Build(halves.above);
    map.nodes_[static_cast<size_t>(index)].children[0] = below;
    map.nodes_[static_cast<size_t>(index)].children[1] = above;
    return index;
  }

  void AddRoad(const std::vector<Vector2d>& border, const Box& box, bool town) {
    if (border.size() != 2) return;
    const double size = box.length;
    RoadClass road_class = RoadClass::kTrack;
    if (size > 0.7 * options.extent_m) {
      road_class = RoadClass::kHighway;
    } else if (size > 0.45 * options.extent_m || (town && size > 3.4 * kPlotDepthM)) {
      road_class = RoadClass::kStreet;
    } else if (size < 2.2 * options.parcel_m || town || random.Uniform(0, 1) < 0.35) {
      return;
    }
    constexpr double kStepM = 6;
    const Vector2d span = border[1] - border[0];
    const int steps = std::max(1, static_cast<int>(span.norm() / kStepM));
    RoadSite site{{}, road_class};
    for (int i = 0; i <= steps; ++i) {
      site.points.push_back(map.Unbend(border[0] + static_cast<double>(i) / steps * span));
    }
    map.road_sites_.push_back(std::move(site));
  }

  int MakeParcel(const std::vector<Vector2d>& polygon, const Box& box, const Vector2d& centre,
                 bool town) {
    Parcel parcel;
    for (const Vector2d& corner : polygon) parcel.corners.push_back(map.Unbend(corner));
    parcel.centre = map.Unbend(centre);
    parcel.along = (map.Unbend(centre + box.along) - parcel.centre).normalized();
    parcel.length_m = box.length;
    parcel.breadth_m = box.breadth;
    parcel.in_town = town;
    parcel.tone = static_cast<float>(random.Uniform(0.75, 1.25));
    parcel.seed = static_cast<uint32_t>(random.Index(1 << 30));
    parcel.kind = KindOfField(options, &random);
    if (town) {
      const bool built = random.Uniform(0, 1) < options.building_fraction;
      const bool paved = random.Uniform(0, 1) < (options.storeys > 3 ? 0.6 : 0.12);
      parcel.kind =
          paved ? ParcelKind::kSquare : (built ? ParcelKind::kGarden : ParcelKind::kMeadow);
    }
    map.parcels_.push_back(std::move(parcel));
    return ~static_cast<int>(map.parcels_.size() - 1);
  }
};

ParcelMap::ParcelMap(const SceneOptions& options)
    : bend_m_(static_cast<float>(std::min(14.0, options.parcel_m / 8))) {
  FillBends(options);
  // A little more than the terrain, for its borders are straight and those of the parcels bent.
  const double half = options.extent_m / 2 + 2 * bend_m_;
  Builder builder{options, *this, Random(HashCell(options.seed, 2, 0x9a7ce15u))};
  const double turn = builder.random.Uniform(0, std::numbers::pi / 2);
  const Eigen::Rotation2Dd rotation(turn);
  const double reach = half * (std::abs(std::cos(turn)) + std::abs(std::sin(turn)));
  std::vector<Vector2d> square;
  for (const Vector2d& corner :
       {Vector2d(-1, -1), Vector2d(1, -1), Vector2d(1, 1), Vector2d(-1, 1)}) {
    square.push_back(rotation * (reach * corner));
  }
  root_ = builder.Build(square);
}

void ParcelMap::FillBends(const SceneOptions& options) {
  const uint32_t seed = HashCell(options.seed, 1, 0x9a7ce15u);
  // Corners of the land to be divided lie at most this far out.
  bends_reach_m_ = static_cast<float>(1.5 * options.extent_m + 4 * bend_m_);
  bends_side_ = static_cast<int>(2 * bends_reach_m_ / kBendCellM) + 2;
  bends_.reserve(static_cast<size_t>(bends_side_) * static_cast<size_t>(bends_side_));
  for (int j = 0; j < bends_side_; ++j) {
    for (int i = 0; i < bends_side_; ++i) {
      const float x = (static_cast<float>(i) * kBendCellM - bends_reach_m_) / kBendLength;
      const float y = (static_cast<float>(j) * kBendCellM - bends_reach_m_) / kBendLength;
      bends_.push_back(bend_m_ *
                       Vector2f(GradientNoise(x, y, 0, seed), GradientNoise(x, y, 0, seed + 1)));
    }
  }
}

Vector2f ParcelMap::Bend(const Vector2f& point) const {
  const auto last = static_cast<float>(bends_side_ - 1) - 1e-3f;
  const float u = std::clamp((point.x() + bends_reach_m_) / kBendCellM, 0.0f, last);
  const float v = std::clamp((point.y() + bends_reach_m_) / kBendCellM, 0.0f, last);
  const int i = std::min(static_cast<int>(u), bends_side_ - 2);
  const int j = std::min(static_cast<int>(v), bends_side_ - 2);
  const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
  const Vector2f* south =
      bends_.data() + static_cast<size_t>(j) * static_cast<size_t>(bends_side_) + i;
  const Vector2f* north = south + bends_side_;
  return point + (1 - fv) * ((1 - fu) * south[0] + fu * south[1]) +
         fv * ((1 - fu) * north[0] + fu * north[1]);
}

Vector2d ParcelMap::Unbend(const Vector2d& bent) const {
  Vector2d point = bent;
  for (int i = 0; i < kUnbendIterations; ++i) {
    point += bent - Bend(point.cast<float>()).cast<double>();
  }
  return point;
}

ParcelMap::Place ParcelMap::Find(float x, float y) const {
  const Vector2f bent = Bend({x, y});
  float border = 1e9f;
  int at = root_;
  while (at >= 0) {
    const Node& node = nodes_[static_cast<size_t>(at)];
    const float distance = node.normal.dot(bent) - node.offset;
    border = std::min(border, std::abs(distance));
    at = node.children[distance < 0 ? 0 : 1];
  }
  return {&parcels_[static_cast<size_t>(~at)], border};
}

}  // namespace deepuav
