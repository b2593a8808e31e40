#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/assembly/live/live_run.h"
#include "deepuav/autopilot/autopilot_link.h"
#include "deepuav/autopilot/autopilot_observer.h"
#include "deepuav/system/sensors/world_watch.h"

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
  /// Null where no sensor says more of the map.
  WorldWatch* watch() { return watch_.get(); }

 private:
  AutopilotListener Ears();
  void Take(const ImuSample& sample);
  void Take(const GnssFix& fix);

  LiveRun* const live_;
  AutopilotObserver observer_;
  std::unique_ptr<WorldWatch> watch_;
  AutopilotLink link_;  ///< Its thread uses the others.
};

/// Null where no autopilot was named. `live` must outlive it, and was not run before. Throws
/// WrongUse for arguments that cannot be.
std::unique_ptr<AutopilotTeller> StartAutopilot(const AutopilotArguments& arguments,
                                                const LiveRequest& request,
                                                const SensorUseOptions& options, LiveRun* live);

}  // namespace deepuav
