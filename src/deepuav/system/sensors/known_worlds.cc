#include "deepuav/system/sensors/known_worlds.h"

#include <cmath>
#include <limits>
#include <ranges>
#include <utility>

namespace deepuav {
namespace {

constexpr size_t kMost = 256;
constexpr int64_t kNewest = std::numeric_limits<int64_t>::max();

/// With the heading and the origin of those before.
MetricFromMap GoingOn(const MetricFromMap& before, MetricFromMap now) {
  const Eigen::Vector3d origin_in_map = before.metric_from_map.Inverse() * Eigen::Vector3d::Zero();
  const Eigen::Vector3d x =
      (before.metric_from_map.rotation() * now.metric_from_map.rotation().conjugate()) *
      Eigen::Vector3d::UnitX();
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(std::atan2(x.y(), x.x()), Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d origin = turn * (now.metric_from_map * origin_in_map);
  now.metric_from_map = Sim3(1, turn, -origin) * now.metric_from_map;
  return now;
}

/// Of the world that `other_from_map` leads to.
MetricFromMap InOther(const Sim3& other_from_map, MetricFromMap metric) {
  const Eigen::Vector3d before = metric.metric_from_map.translation();
  metric.metric_from_map = metric.metric_from_map * other_from_map.Inverse();
  if (!metric.covariance) return metric;
  // Turn and scale are about another point then, which they shift.
  const Eigen::Vector3d arm = metric.metric_from_map.translation() - before;
  Eigen::Matrix<double, 7, 7> moved = Eigen::Matrix<double, 7, 7>::Identity();
  moved.block<3, 3>(3, 0) = -Skew(arm);
  moved.block<3, 1>(3, 6) = arm;
  metric.covariance = moved * *metric.covariance * moved.transpose();
  return metric;
}

}  // namespace

void KnownWorlds::Use(MapId map, int64_t revision, const std::optional<MetricFromMap>& metric) {
  const std::optional<MetricFromMap> before = In(map, kNewest);
  const bool goes_on = before && metric && !before->origin && !metric->origin;
  Keep({map, revision, goes_on ? GoingOn(*before, *metric) : metric});
}

void KnownWorlds::Keep(Since since) {
  const std::optional<MetricFromMap> before = In(since.map, kNewest);
  if (before && before->origin && since.metric && !since.metric->origin) return;
  known_.push_back(std::move(since));
  if (known_.size() > kMost) known_.pop_front();
}

void KnownWorlds::OnMap(const MapEvent& event) {
  if (event.change != MapChange::kMerged) return;
  const std::optional<MetricFromMap> known = In(event.into, kNewest);
  const std::optional<MetricFromMap> metric = In(event.map, kNewest);
  if (!metric || (known && (known->origin || !metric->origin))) return;
  Keep({event.into, event.revision, InOther(event.into_from_map, *metric)});
}

/// A free one says nothing against what others know of the map.
void KnownWorlds::OnGauge(MapId map, int64_t revision, const Gauge& gauge) {
  if (const auto metric = MetricOf(gauge)) Keep({map, revision, metric});
}

std::optional<MetricFromMap> KnownWorlds::In(MapId map, int64_t revision) const {
  for (const Since& since : std::views::reverse(known_)) {
    if (since.map == map && since.revision <= revision) return since.metric;
  }
  return std::nullopt;
}

}  // namespace deepuav
