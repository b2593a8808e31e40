#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/assembly/live/live_run.h"
#include "deepuav/autopilot/autopilot_link.h"
#include "deepuav/autopilot/autopilot_observer.h"
#include "deepuav/system/sensors/metric_watch.h"
#include "deepuav/system/sensors/place_watch.h"

namespace deepuav {

/// What the command line says of the autopilot.
struct AutopilotArguments {
  std::string address;  ///< Empty: none.
  std::string mount = "forward", mount_offset = "0,0,0", antenna = "0,0,0";
  AutopilotOptions options;
};

void AddAutopilotArguments(CLI::App& command, AutopilotArguments& arguments);

/// Sensors that say more of the map on the way than its images do, if there are any, fixed to the
/// camera: with what they measured, or the autopilot's own.
struct SensorsOnTheWay {
  std::optional<ImuStream> imu;    ///< Gives the map metres.
  std::optional<GnssStream> gnss;  ///< Gives it its place on Earth.
};

/// Tells an autopilot where the vehicle is from the beginning to the end of its life, and hears its
/// sensors where the options want them: `live` gets these, too.
class AutopilotTeller {
 public:
  /// `live` must outlive it.
  AutopilotTeller(const AutopilotArguments& arguments, const SE3& body_from_cam,
                  SensorsOnTheWay sensors, const SensorUseOptions& options, LiveRun* live);

  AutopilotObserver* observer() { return &observer_; }
  /// Null where no sensor gives the map metres.
  MetricWatch* metric_watch() { return metric_watch_.get(); }
  /// Null where none gives it a place.
  PlaceWatch* place_watch() { return place_watch_.get(); }

 private:
  AutopilotListener Ears();
  void Take(const ImuSample& sample);
  void Take(const GnssFix& fix);

  LiveRun* const live_;
  AutopilotObserver observer_;
  std::unique_ptr<PlaceWatch> place_watch_;
  std::unique_ptr<MetricWatch> metric_watch_;  ///< Its thread uses the place's watch.
  AutopilotLink link_;                         ///< Its thread uses the others.
};

/// Null where no autopilot was named. `live` must outlive it, and was not run before. Throws
/// WrongUse for arguments that cannot be.
std::unique_ptr<AutopilotTeller> StartAutopilot(const AutopilotArguments& arguments,
                                                const LiveRequest& request,
                                                const SensorUseOptions& options, LiveRun* live);

}  // namespace deepuav
