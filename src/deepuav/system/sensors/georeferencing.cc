#include "deepuav/system/sensors/georeferencing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/system/frames/frame_path.h"
#include "deepuav/system/sensors/fix_trial.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kRounds = 2;  // Who is an outlier shows better once the fixes took out the drift.
/// Fixes to centimetres show it better with each round, while their spread still falls by so much.
constexpr int kCarrierRounds = 8;
constexpr double kSpreadStillFalls = 0.8;
/// Pairs of keyframes whose distances together hold the scale of a map.
constexpr int kDistances = 20;
/// Over their common standard deviation: fixes and IMU contradict each other.
constexpr double kContradictionSigmas = 4;
/// Whether the map was still so far off that what the fixes state shows only now.
bool SpreadFell(const Georeference& before, const Georeference& now) {
  return now.by_carrier && (now.horizontal_ratio < kSpreadStillFalls * before.horizontal_ratio ||
                            now.vertical_ratio < kSpreadStillFalls * before.vertical_ratio);
}

/// Knows which way is about up, and nothing more.
constexpr MetricPrior kRoughlyUp{1e3, 1e3};

/// How far the fixes alone would move what the prior knows, over the standard deviation of that.
double Contradiction(const Georeference& by_fixes, const MetricPrior& known) {
  const auto sigmas = [](double difference, double sigma, double known_sigma) {
    return std::abs(difference) / std::hypot(sigma, known_sigma);
  };
  const double scale = std::log(by_fixes.local_from_world.scale());
  double most = sigmas(scale, by_fixes.scale_sigma(), known.scale_sigma);
  const Eigen::Vector3d up = by_fixes.local_from_world.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d turn =  // By which the fixes tilt the map.
      std::atan2(up.head<2>().norm(), up.z()) * Eigen::Vector2d(-up.y(), up.x()).stableNormalized();
  for (int axis = 0; axis < 2; ++axis) {
    const double sigma = std::sqrt(by_fixes.covariance(kTurn + axis, kTurn + axis));
    most = std::max(most, sigmas(turn[axis], sigma, known.tilt_sigma_rad));
  }
  return most;
}

}  // namespace

void BarometerNoise::Check() const { CheckOptions("sensors.barometer", *this); }

void SensorUseOptions::Check() const { CheckOptions("sensors", *this); }

Georeferencing::Georeferencing(const SensorStreams& streams, const SensorUseOptions& options,
                               MetricPriors priors, Mapper* mapper, Atlas* atlas)
    : streams_(streams),
      options_(options),
      priors_(std::move(priors)),
      mapper_(mapper),
      atlas_(atlas) {
  if (streams.gnss.fixes.empty()) return;
  const GnssFix& first = streams.gnss.fixes.front();
  origin_ = {first.latitude_deg, first.longitude_deg, first.altitude_m.value_or(0)};
  fixes_ = LocalFixes(streams.gnss.fixes, origin_, options.gnss);
}

GeoreferenceReport Georeferencing::Apply(MapId map, const std::vector<FrameRecord>& records,
                                         Pinhole* pinhole, bool refine_focal,
                                         const std::function<bool()>& stop) {
  GeoreferenceReport report;
  report.origin = origin_;
  ClockPrior clock{options_.gnss_clock_offset_s,
                   options_.search_gnss_clock ? streams_.gnss.clock_sigma_s : 0};
  const Trajectory path = PathIn(*atlas_, map, records);
  const MetricPrior* known = KnownOf(map, path, clock);
  GeoreferenceAttempt attempt = Find(path, clock, known);
  report.reason = attempt.reason;
  if (!attempt.found) return report;
  report.found = attempt.found;
  report.held_by_imu = known != nullptr;
  std::optional<MapFactors> by_imu;
  if (known) by_imu = MetricFactors(map, *known);
  mapper_->ChangeGauge(map, attempt.found->local_from_world,
                       {GaugeKind::kGeoreferenced, origin_, attempt.found->scale_sigma()});
  clock = {attempt.found->clock_offset_s, 0};
  for (int round = 0; round < kCarrierRounds && !(stop && stop()); ++round) {
    // Outliers and spread about the path as it is now; its place follows from the factors.
    const Georeference before = *attempt.found;
    attempt = Find(PathIn(*atlas_, map, records), clock, known);
    if (!attempt.found) break;
    if (round >= kRounds && !SpreadFell(before, *attempt.found)) break;
    report.factors = FactorsOf(map, *attempt.found, by_imu);
    mapper_->AdjustGlobally(map, pinhole, refine_focal, stop, &report.factors);
    report.height_steps = static_cast<int>(report.factors.height_steps.size());
  }
  attempt = Find(PathIn(*atlas_, map, records), clock, known);
  if (attempt.found && attempt.found->by_carrier &&
      TrustFixes(atlas_->At(map), *pinhole, &*attempt.found)) {
    report.factors = FactorsOf(map, *attempt.found, by_imu);
    mapper_->AdjustGlobally(map, pinhole, refine_focal, stop, &report.factors);
    attempt = Find(PathIn(*atlas_, map, records), clock, known);
  }
  if (attempt.found) {
    report.fixes = static_cast<int>(attempt.found->positions.size());
    report.used = attempt.found->used();
    report.horizontal_rms_m = attempt.found->horizontal_rms_m;
    report.vertical_rms_m = attempt.found->vertical_rms_m;
  }
  return report;
}

std::map<MapId, GeoreferenceReport> Georeferencing::ApplyToAll(
    const std::vector<MapId>& maps, const std::vector<FrameRecord>& records, Pinhole* pinhole,
    const std::function<bool(MapId)>& refines_focal, const std::function<bool()>& stop) {
  std::map<MapId, GeoreferenceReport> reports;
  for (const MapId map : maps) {
    if (stop && stop()) break;
    if (atlas_->GaugeOf(map).kind == GaugeKind::kGeoreferenced) continue;
    GeoreferenceReport& report = reports[map];
    report = Apply(map, records, pinhole, refines_focal(map), stop);
    if (report.found) {
      Log().info(
          "map {} is georeferenced by {} of {} fixes, {:.2f} m from its path; {:+.2f} s are "
          "added to their times",
          map.value, report.used, report.fixes, report.horizontal_rms_m,
          report.found->clock_offset_s);
    } else {
      Log().warn("map {} is not georeferenced: {}", map.value, report.reason);
    }
  }
  return reports;
}

std::vector<Georeferencing::TimedKeyframe> Georeferencing::KeyframesOf(MapId map) const {
  std::vector<TimedKeyframe> keyframes;
  atlas_->At(map).keyframes().ForEach([&](const Keyframe& keyframe) {
    keyframes.push_back({keyframe.frame.time, keyframe.id});
  });
  std::stable_sort(keyframes.begin(), keyframes.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
  return keyframes;
}

GeoreferenceAttempt Georeferencing::Find(const Trajectory& path, const ClockPrior& clock,
                                         const MetricPrior* known) const {
  return FindGeoreference(path, fixes_, streams_.gnss.antenna_cam_m, clock, options_.gnss,
                          options_.georeference, known);
}

const MetricPrior* Georeferencing::KnownOf(MapId map, const Trajectory& path,
                                           const ClockPrior& clock) const {
  const auto prior = priors_.find(map);
  if (prior == priors_.end() || atlas_->GaugeOf(map).kind != GaugeKind::kMetric) return nullptr;
  const GeoreferenceAttempt by_fixes = Find(path, clock, &kRoughlyUp);
  if (!by_fixes.found || Contradiction(*by_fixes.found, prior->second) <= kContradictionSigmas)
    return &prior->second;
  Log().warn(
      "the fixes contradict the IMU on map {}: scale {:.3f} of the IMU's; the fixes are believed",
      map.value, by_fixes.found->local_from_world.scale());
  return nullptr;
}

MapFactors Georeferencing::FactorsOf(MapId map, const Georeference& found,
                                     const std::optional<MapFactors>& by_imu) const {
  const std::vector<TimedKeyframe> keyframes = KeyframesOf(map);
  MapFactors factors = by_imu.value_or(MapFactors{});
  AddPositions(atlas_->At(map), keyframes, found, &factors);
  AddHeightSteps(keyframes, &factors);
  if (!by_imu) AddLevels(keyframes, &factors);
  return factors;
}

/// So weak each that all together say what the prior says.
MapFactors Georeferencing::MetricFactors(MapId id, const MetricPrior& known) const {
  const Map& map = atlas_->At(id);
  const std::vector<TimedKeyframe> keyframes = KeyframesOf(id);
  MapFactors factors;
  const double level_per_sigma =
      1 / (known.tilt_sigma_rad * std::sqrt(static_cast<double>(keyframes.size())));
  for (const TimedKeyframe& keyframe : keyframes) {
    const Eigen::Matrix3d cam_from_world = map.At(keyframe.id).cam_from_world.RotationMatrix();
    for (int axis = 0; axis < 2; ++axis)
      factors.levels.push_back({keyframe.id, {0, level_per_sigma, cam_from_world.col(axis)}});
  }
  const size_t pairs = std::min<size_t>(kDistances, keyframes.size() - 1);
  const double share_sigma = known.scale_sigma * std::sqrt(static_cast<double>(pairs));
  for (size_t k = 0; k < pairs; ++k) {
    const KeyframeId first = keyframes[k * (keyframes.size() - 1) / pairs].id;
    const KeyframeId second = keyframes[(k + 1) * (keyframes.size() - 1) / pairs].id;
    const double distance = (map.At(second).cam_from_world.InverseTranslation() -
                             map.At(first).cam_from_world.InverseTranslation())
                                .norm();
    if (distance > 0)
      factors.distances.push_back({first, second, {0, 0, distance, 1 / (share_sigma * distance)}});
  }
  return factors;
}

/// A photograph that few landmarks hold, all in a corner, may be as far from its fix as its tilt
/// makes up for: the fix counts again where most of the landmarks let the photograph be there.
/// False: there is none such.
bool Georeferencing::TrustFixes(const Map& map, const Pinhole& pinhole, Georeference* found) const {
  Georeference outliers = *found;
  for (uint8_t& outlier : outliers.outlier) outlier = !outlier;
  MapFactors factors;
  AddPositions(map, KeyframesOf(map.id()), outliers, &factors);
  size_t next = 0;
  bool trusts = false;
  for (uint8_t& outlier : found->outlier) {
    if (!outlier) continue;
    const auto& [keyframe, fix] = factors.positions[next++];
    const FixTrial trial = TryFix(map, keyframe, fix, pinhole);
    if (trial.fix_sigmas > options_.georeference.outlier_sigmas) continue;
    const double enough = options_.min_agreeing_with_fix * trial.agreeing_now;
    if (trial.agreeing == 0 || trial.agreeing < enough) continue;
    outlier = 0;
    trusts = true;
  }
  return trusts;
}

/// A fix belongs to the keyframe next in time, as a point fixed to it: where the path has the
/// antenna then.
void Georeferencing::AddPositions(const Map& map, const std::vector<TimedKeyframe>& keyframes,
                                  const Georeference& found, MapFactors* factors) const {
  size_t next = 0;
  for (size_t i = 0; i < found.positions.size(); ++i) {
    if (found.outlier[i]) continue;
    const PositionOnPath& at = found.positions[i];
    const auto distance_s = [&](size_t k) {
      return std::abs(SecondsBetween(keyframes[k].time, at.camera.time));
    };
    while (next + 1 < keyframes.size() && distance_s(next + 1) <= distance_s(next)) ++next;
    const Keyframe& keyframe = map.At(keyframes[next].id);
    PositionFactor factor;
    factor.point_cam =
        keyframe.cam_from_world * (at.camera.world_from_cam * streams_.gnss.antenna_cam_m);
    factor.position_world = at.position_m;
    factor.per_sigma = found.IndependentSigma(i).cwiseInverse();
    factors->positions.push_back({keyframe.id, factor});
  }
}

std::optional<Georeferencing::Height> Georeferencing::BarometerAt(Timestamp time) const {
  const auto& samples = streams_.barometer.samples;
  const auto window_ns = static_cast<int64_t>(options_.barometer.window_s * 1e9);
  const auto from =
      std::lower_bound(samples.begin(), samples.end(), Timestamp{time.nanoseconds - window_ns},
                       [](const BarometerSample& sample, Timestamp t) { return sample.time < t; });
  double sum = 0, count = 0;
  for (auto at = from; at != samples.end() && at->time.nanoseconds <= time.nanoseconds + window_ns;
       ++at) {
    sum += at->altitude_m;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Height{sum / count, options_.barometer.sigma_m * options_.barometer.sigma_m / count};
}

void Georeferencing::AddHeightSteps(const std::vector<TimedKeyframe>& keyframes,
                                    MapFactors* factors) const {
  std::optional<std::pair<TimedKeyframe, Height>> last;
  for (const TimedKeyframe& keyframe : keyframes) {
    if (last && SecondsBetween(last->first.time, keyframe.time) < options_.barometer.step_s)
      continue;
    const std::optional<Height> height = BarometerAt(keyframe.time);
    if (!height) continue;
    if (last) {
      const double drift_m = options_.barometer.drift_m_sqrt_s;
      const double variance = last->second.variance_m2 + height->variance_m2 +
                              drift_m * drift_m * SecondsBetween(last->first.time, keyframe.time);
      HeightStepFactor factor;
      factor.first_point_cam = factor.second_point_cam = streams_.barometer.sensor_cam_m;
      factor.step_world = height->height_m - last->second.height_m;
      factor.per_sigma = 1 / std::sqrt(variance);
      factors->height_steps.push_back({last->first.id, keyframe.id, factor});
    }
    last = {keyframe, *height};
  }
}

/// So weak each that all together say what the options say of their mean.
void Georeferencing::AddLevels(const std::vector<TimedKeyframe>& keyframes,
                               MapFactors* factors) const {
  const double sigma = options_.georeference.level_sigma_deg * kDegree;
  const double per_sigma = 1 / (sigma * std::sqrt(static_cast<double>(keyframes.size())));
  for (const TimedKeyframe& keyframe : keyframes)
    factors->levels.push_back({keyframe.id, {.per_sigma = per_sigma}});
}

}  // namespace deepuav
