#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/inertial/inertial_options.h"
#include "deepuav/map/atlas.h"
#include "deepuav/mapping/adjustment/map_factors.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/sensors/georeference.h"
#include "deepuav/sensors/streams.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// What a barometer is trusted with: differences, as the weather moves its zero.
struct BarometerNoise {
  double sigma_m = 0.3;          ///< White error of a sample.
  double drift_m_sqrt_s = 0.05;  ///< Random walk of the zero, m/sqrt(s).
  double step_s = 2;             ///< Between two keyframes whose heights are compared, at least.
  double window_s = 0.25;        ///< About a keyframe, of the samples that are averaged.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("sigma_m", sigma_m, "m", "standard deviation of the white error", Between(0.001, 10'000));
    visit("drift_m_sqrt_s", drift_m_sqrt_s, "m/sqrt(s)", "random walk of the zero",
          Between(0, 10'000));
    visit("step_s", step_s, "s", "least time between two keyframes whose heights are compared",
          Between(0.001, 1e6));
    visit("window_s", window_s, "s", "about a keyframe, of the samples that are averaged",
          Between(0, 1e6));
  }
};

struct SensorUseOptions {
  double gnss_clock_offset_s = 0;  ///< Added to the fixes' times, or where the search begins.
  bool search_gnss_clock = true;   ///< Where the receiver has a clock of its own.
  /// Landmarks that agree where a fix beyond the others' spread puts its photograph, over those
  /// that agree where it is, from which the fix counts.
  double min_agreeing_with_fix = 0.7;
  GnssNoise gnss;
  BarometerNoise barometer;
  AttitudeNoise attitude;
  GeoreferenceOptions georeference;
  InertialOptions imu;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("gnss_clock_offset_s", gnss_clock_offset_s, "s",
          "added to the times of the fixes, or where the search for it begins",
          Between(-4e8, 4e8));  // The epochs of GPS and of Unix are 3.2e8 s apart.
    visit("search_gnss_clock", search_gnss_clock, "",
          "search the clock offset where the receiver has a clock of its own");
    visit("min_agreeing_with_fix", min_agreeing_with_fix, "",
          "landmarks that agree where a fix beyond the others' spread puts its photograph, over "
          "those that agree where it is, from which the fix counts",
          Above(0, 1));
    visit.Part("gnss", gnss);
    visit.Part("barometer", barometer);
    visit.Part("attitude", attitude);
    visit.Part("georeference", georeference);
    visit.Part("imu", imu);
  }
};

/// How a map came to its place on Earth.
struct GeoreferenceReport {
  std::optional<Georeference> found;  ///< Before the map was adjusted with the fixes.
  std::string reason;                 ///< Why not, for a person.
  GeoPoint origin;
  int fixes = 0;                  ///< That lie on the path.
  int used = 0;                   ///< Of these, no outliers.
  int height_steps = 0;           ///< Of the barometer.
  bool held_by_imu = false;       ///< In scale and level, by what an IMU had said of the map.
  bool held_by_attitude = false;  ///< In its orientation, by the gimbal's angles.
  double horizontal_rms_m = 0, vertical_rms_m = 0;  ///< Of the fixes used, at the end.
  MapFactors factors;                               ///< That the map was adjusted with.
};

/// What an IMU said of the maps that it gave metres.
using MetricPriors = std::map<MapId, MetricPrior>;

/// Gives maps their place on Earth at the end of a run: finds the similarity under which the path
/// lies nearest to the fixes, changes the map's gauge, and adjusts the map once more with the fixes
/// and the barometer's height steps. Scale and level that an IMU gave before and the orientation
/// that the gimbal's angles tell hold as they are known, unless the fixes contradict them.
class Georeferencing {
 public:
  /// All must outlive it.
  Georeferencing(const SensorStreams& streams, const SensorUseOptions& options, MetricPriors priors,
                 Mapper* mapper, Atlas* atlas);

  /// `records`: of all frames, their anchored poses valid.
  GeoreferenceReport Apply(MapId map, const std::vector<FrameRecord>& records, Pinhole* pinhole,
                           bool refine_focal, const std::function<bool()>& stop);

  /// The same, one after another, for all of these maps that have no place yet: by an earlier run.
  /// Whether the fixes tell more of the lens than views of flat ground from one height do.
  bool TellsFocalLength() const { return AreByCarrier(fixes_, options_.gnss); }

  /// `refines_focal`: whether with a map the focal length is refined.
  std::map<MapId, GeoreferenceReport> ApplyToAll(const std::vector<MapId>& maps,
                                                 const std::vector<FrameRecord>& records,
                                                 Pinhole* pinhole,
                                                 const std::function<bool(MapId)>& refines_focal,
                                                 const std::function<bool()>& stop);

 private:
  struct TimedKeyframe {
    Timestamp time;
    KeyframeId id;
  };

  std::vector<TimedKeyframe> KeyframesOf(MapId map) const;
  /// What counts beside the fixes.
  struct Beside {
    const MetricPrior* metric = nullptr;
    bool attitudes = false;
  };

  PlacePriors PriorsOn(const Trajectory& path, const Beside& known) const;
  GeoreferenceAttempt Find(const Trajectory& path, const ClockPrior& clock,
                           const PlacePriors& known) const;
  /// Of the map, unless its fixes contradict it.
  Beside KnownOf(MapId map, const Trajectory& path, const ClockPrior& clock) const;
  const MetricPrior* MetricOf(MapId map, const Trajectory& path, const ClockPrior& clock) const;
  bool AttitudesHold(MapId map, const Trajectory& path, const ClockPrior& clock,
                     const Beside& known) const;
  MapFactors FactorsOf(MapId map, const PlacePriors& known) const;
  MapFactors FactorsOf(MapId map, const Georeference& found, const MapFactors& held) const;
  bool TrustFixes(const Map& map, const Pinhole& pinhole, Georeference* found) const;
  void AddPositions(const Map& map, const std::vector<TimedKeyframe>& keyframes,
                    const Georeference& found, MapFactors* factors) const;
  void AddHeightSteps(const std::vector<TimedKeyframe>& keyframes, MapFactors* factors) const;
  /// The barometer's height at a moment, and the variance of its white error.
  struct Height {
    double height_m, variance_m2;
  };
  std::optional<Height> BarometerAt(Timestamp time) const;

  const SensorStreams& streams_;
  const SensorUseOptions options_;
  const MetricPriors priors_;
  Mapper* mapper_;
  Atlas* atlas_;
  GeoPoint origin_;
  std::vector<LocalFix> fixes_;
};

}  // namespace deepuav
