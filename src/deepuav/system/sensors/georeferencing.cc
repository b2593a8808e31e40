#include "deepuav/system/sensors/georeferencing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/frames/frame_path.h"
#include "deepuav/system/sensors/fix_trial.h"
#include "deepuav/system/sensors/known_place.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kRounds = 2;  // Who is an outlier shows better once the fixes took out the drift.
/// Fixes to centimetres show it better with each round, while their spread still falls by so much.
constexpr int kCarrierRounds = 8;
constexpr double kSpreadStillFalls = 0.8;

/// Whether the map was still so far off that what the fixes state shows only now.
bool SpreadFell(const Georeference& before, const Georeference& now) {
  return now.by_carrier && (now.horizontal_ratio < kSpreadStillFalls * before.horizontal_ratio ||
                            now.vertical_ratio < kSpreadStillFalls * before.vertical_ratio);
}

constexpr double kOpen_rad = 3;

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
  origin_ = PlaceOf(streams.gnss.fixes.front());
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
  const Beside known = KnownOf(map, path, clock);
  GeoreferenceAttempt attempt = Find(path, clock, PriorsOn(path, known));
  report.reason = attempt.reason;
  if (!attempt.found) return report;
  report.found = attempt.found;
  report.held_by_imu = known.metric != nullptr;
  report.held_by_attitude = known.attitudes;
  const MapFactors held = FactorsOf(map, PriorsOn(path, known));
  mapper_->ChangeGauge(map, attempt.found->local_from_world,
                       {GaugeKind::kGeoreferenced, origin_, attempt.found->scale_sigma()});
  clock = {attempt.found->clock_offset_s, 0};
  const auto find_again = [&] {
    const Trajectory now = PathIn(*atlas_, map, records);
    const PlacePriors priors = PriorsOn(now, known);
    report.held_by_attitude = priors.orientation.has_value();
    return Find(now, clock, priors);
  };
  for (int round = 0; round < kCarrierRounds && !(stop && stop()); ++round) {
    // Outliers and spread about the path as it is now; its place follows from the factors.
    const Georeference before = *attempt.found;
    attempt = find_again();
    if (!attempt.found) break;
    if (round >= kRounds && !SpreadFell(before, *attempt.found)) break;
    report.factors = FactorsOf(map, *attempt.found, held);
    mapper_->AdjustGlobally(map, pinhole, refine_focal, stop, &report.factors);
    report.height_steps = static_cast<int>(report.factors.height_steps.size());
  }
  attempt = find_again();
  if (attempt.found && attempt.found->by_carrier &&
      TrustFixes(atlas_->At(map), *pinhole, &*attempt.found)) {
    report.factors = FactorsOf(map, *attempt.found, held);
    mapper_->AdjustGlobally(map, pinhole, refine_focal, stop, &report.factors);
    attempt = find_again();
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

PlacePriors Georeferencing::PriorsOn(const Trajectory& path, const Beside& known) const {
  PlacePriors priors;
  if (known.metric) priors.metric = *known.metric;
  if (known.attitudes) {
    priors.orientation =
        OrientationByAttitudes(path, streams_.attitude.samples, options_.attitude).found;
  }
  return priors;
}

GeoreferenceAttempt Georeferencing::Find(const Trajectory& path, const ClockPrior& clock,
                                         const PlacePriors& known) const {
  return FindGeoreference(path, fixes_, streams_.gnss.antenna_cam_m, clock, options_.gnss,
                          options_.georeference, known);
}

Georeferencing::Beside Georeferencing::KnownOf(MapId map, const Trajectory& path,
                                               const ClockPrior& clock) const {
  Beside known{MetricOf(map, path, clock)};
  known.attitudes = AttitudesHold(map, path, clock, known);
  return known;
}

const MetricPrior* Georeferencing::MetricOf(MapId map, const Trajectory& path,
                                            const ClockPrior& clock) const {
  const auto prior = priors_.find(map);
  if (prior == priors_.end() || atlas_->GaugeOf(map).kind != GaugeKind::kMetric) return nullptr;
  const GeoreferenceAttempt by_fixes = Find(path, clock, {.metric = kRoughlyUp});
  if (!by_fixes.found || Contradiction(*by_fixes.found, prior->second) <= kContradictionSigmas)
    return &prior->second;
  Log().warn(
      "the fixes contradict the IMU on map {}: scale {:.3f} of the IMU's; the fixes are believed",
      map.value, by_fixes.found->local_from_world.scale());
  return nullptr;
}

bool Georeferencing::AttitudesHold(MapId map, const Trajectory& path, const ClockPrior& clock,
                                   const Beside& known) const {
  if (streams_.attitude.samples.empty()) return false;
  const OrientationAttempt attempt =
      OrientationByAttitudes(path, streams_.attitude.samples, options_.attitude);
  if (!attempt.found) {
    Log().warn("the gimbal's angles do not count on map {}: {}", map.value, attempt.reason);
    return false;
  }
  PlacePriors rough = PriorsOn(path, known);
  rough.orientation = OrientationPrior{attempt.found->local_from_world, kOpen_rad, kOpen_rad};
  GeoreferenceOptions open = options_.georeference;
  open.max_turn_sigma_deg = 180;  // What the fixes do tell may contradict, though they leave much.
  const GeoreferenceAttempt by_fixes = FindGeoreference(path, fixes_, streams_.gnss.antenna_cam_m,
                                                        clock, options_.gnss, open, rough);
  if (!by_fixes.found || Contradiction(*by_fixes.found, *attempt.found) <= kContradictionSigmas)
    return true;
  Log().warn(
      "the fixes contradict the gimbal's angles on map {}, by {:.0f} degrees; the fixes are "
      "believed",
      map.value,
      by_fixes.found->local_from_world.rotation().angularDistance(attempt.found->local_from_world) /
          kDegree);
  return false;
}

/// What is known beside the fixes, of the map as it lies before they move it.
MapFactors Georeferencing::FactorsOf(MapId map, const PlacePriors& known) const {
  std::vector<KeyframeId> keyframes;
  for (const TimedKeyframe& keyframe : KeyframesOf(map)) keyframes.push_back(keyframe.id);
  return deepuav::FactorsOf(known, atlas_->At(map), keyframes,
                            options_.georeference.level_sigma_deg * kDegree);
}

MapFactors Georeferencing::FactorsOf(MapId map, const Georeference& found,
                                     const MapFactors& held) const {
  const std::vector<TimedKeyframe> keyframes = KeyframesOf(map);
  MapFactors factors = held;
  AddPositions(atlas_->At(map), keyframes, found, &factors);
  AddHeightSteps(keyframes, &factors);
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

}  // namespace deepuav
