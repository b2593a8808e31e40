#include "deepuav/simulation/world/road_network.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr float kCellM = 8;
constexpr double kShortestM = 25;

float HalfWidth(RoadClass road_class) {
  switch (road_class) {
    case RoadClass::kTrack:
      return 1.5f;
    case RoadClass::kStreet:
      return 2.9f;
    case RoadClass::kHighway:
      break;
  }
  return 3.8f;
}

}  // namespace

Road MakeRoad(const RoadSite& site) {
  Road road{site.points, {0}, site.road_class, HalfWidth(site.road_class)};
  for (size_t i = 1; i < road.points.size(); ++i) {
    road.arc_m.push_back(road.arc_m.back() + (road.points[i] - road.points[i - 1]).norm());
  }
  return road;
}

void RoadNetwork::AddPiece(RoadSite* piece) {
  if (piece->points.size() >= 2) {
    Road road = MakeRoad(*piece);
    if (road.length_m() > kShortestM) roads_.push_back(std::move(road));
  }
  piece->points.clear();
}

void RoadNetwork::BuildIndex() {
  std::stable_sort(roads_.begin(), roads_.end(),
                   [](const Road& a, const Road& b) { return a.length_m() > b.length_m(); });
  cells_ = std::max(1, static_cast<int>(std::ceil(2 * half_extent_m_ / kCellM)));
  std::vector<std::vector<int>> lists(static_cast<size_t>(cells_) * cells_);
  for (size_t r = 0; r < roads_.size(); ++r) {
    const Road& road = roads_[r];
    for (size_t i = 1; i < road.points.size(); ++i) {
      const Eigen::Vector2f start = road.points[i - 1].cast<float>();
      const Eigen::Vector2f span = road.points[i].cast<float>() - start;
      const float length = span.norm(), reach = road.half_width_m + kVergeM;
      const int index = static_cast<int>(segments_.size());
      segments_.push_back({start, span / length, length, static_cast<float>(road.arc_m[i - 1]),
                           static_cast<int>(r)});
      const auto cell_of = [&](float at) {
        return std::clamp(static_cast<int>((at + half_extent_m_) / kCellM), 0, cells_ - 1);
      };
      const Eigen::Vector2f end = start + span, low = start.cwiseMin(end),
                            high = start.cwiseMax(end);
      for (int y = cell_of(low.y() - reach); y <= cell_of(high.y() + reach); ++y) {
        for (int x = cell_of(low.x() - reach); x <= cell_of(high.x() + reach); ++x) {
          lists[static_cast<size_t>(y) * cells_ + x].push_back(index);
        }
      }
    }
  }
  cell_begin_.push_back(0);
  for (const std::vector<int>& list : lists) {
    cell_segments_.insert(cell_segments_.end(), list.begin(), list.end());
    cell_begin_.push_back(static_cast<int>(cell_segments_.size()));
  }
}

RoadNetwork::Place RoadNetwork::Find(float x, float y) const {
  Place place;
  const auto half = static_cast<float>(half_extent_m_);
  const int cx = static_cast<int>((x + half) / kCellM), cy = static_cast<int>((y + half) / kCellM);
  if (x < -half || y < -half || cx >= cells_ || cy >= cells_) return place;
  const size_t cell = static_cast<size_t>(cy) * cells_ + cx;
  for (int k = cell_begin_[cell]; k < cell_begin_[cell + 1]; ++k) {
    const Segment& segment = segments_[static_cast<size_t>(cell_segments_[static_cast<size_t>(k)])];
    const Eigen::Vector2f from_start = Eigen::Vector2f(x, y) - segment.start;
    const float along = std::clamp(segment.direction.dot(from_start), 0.0f, segment.length);
    const Eigen::Vector2f offset = from_start - along * segment.direction;
    const Road& road = roads_[static_cast<size_t>(segment.road)];
    const float distance = offset.norm(), edge = distance - road.half_width_m;
    if (edge > kVergeM) continue;
    if (edge < 0 && place.edge_m < 0 && place.road != &road) place.junction = true;
    if (edge >= place.edge_m) continue;
    const bool left = segment.direction.x() * offset.y() - segment.direction.y() * offset.x() > 0;
    place.road = &road;
    place.across_m = left ? distance : -distance;
    place.along_m = segment.arc + along;
    place.edge_m = edge;
  }
  return place;
}

}  // namespace deepuav
