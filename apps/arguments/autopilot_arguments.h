#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/assembly/live/live_run.h"
#include "deepuav/autopilot/autopilot_link.h"
#include "deepuav/autopilot/autopilot_observer.h"
#include "deepuav/system/sensors/metric_watch.h"

namespace deepuav {

/// What the command line says of the autopilot.
struct AutopilotArguments {
  std::string address;  ///< Empty: none.
  std::string mount = "forward", mount_offset = "0,0,0";
  AutopilotOptions options;
};

void AddAutopilotArguments(CLI::App& command, AutopilotArguments& arguments);

/// Tells an autopilot where the vehicle is from the beginning to the end of its life, and hears its
/// inertial samples where the options want them.
class AutopilotTeller {
 public:
  /// `imu`: a sensor that gives the map metres on the way, if there is one, fixed to the camera:
  /// with its samples, or the autopilot's own, which `live` gets then, too. `live` must outlive it.
  AutopilotTeller(const AutopilotArguments& arguments, const SE3& body_from_cam,
                  std::optional<ImuStream> imu, const InertialOptions& inertial, LiveRun* live);

  AutopilotObserver* observer() { return &observer_; }
  /// Null where no sensor gives the map metres.
  MetricWatch* metric_watch() { return watch_.get(); }

 private:
  void Take(const ImuSample& sample);

  LiveRun* const live_;
  AutopilotObserver observer_;
  std::unique_ptr<MetricWatch> watch_;
  AutopilotLink link_;  ///< Its thread uses the others.
};

/// Null where no autopilot was named. `live` must outlive it, and was not run before. Throws
/// WrongUse for arguments that cannot be.
std::unique_ptr<AutopilotTeller> StartAutopilot(const AutopilotArguments& arguments,
                                                const LiveRequest& request,
                                                const InertialOptions& inertial, LiveRun* live);

}  // namespace deepuav
