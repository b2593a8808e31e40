#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/assembly/live_run.h"
#include "deepuav/autopilot/autopilot_link.h"
#include "deepuav/autopilot/autopilot_observer.h"
#include "deepuav/system/metric_watch.h"

namespace deepuav {

/// What the command line says of the autopilot.
struct AutopilotArguments {
  std::string address;  ///< Empty: none.
  std::string mount = "forward", mount_offset = "0,0,0";
  AutopilotOptions options;
};

void AddAutopilotArguments(CLI::App& command, AutopilotArguments& arguments);

/// Tells an autopilot where the vehicle is from the beginning to the end of its life.
class AutopilotTeller {
 public:
  AutopilotTeller(const AutopilotArguments& arguments, const SE3& body_from_cam);

  AutopilotObserver* observer() { return &observer_; }

 private:
  AutopilotObserver observer_;
  AutopilotLink link_;
};

/// Null where no autopilot was named. Throws WrongUse for arguments that cannot be.
std::unique_ptr<AutopilotTeller> StartAutopilot(const AutopilotArguments& arguments,
                                                const LiveRequest& request, const LiveRun& live);

/// Tells the autopilot's teller of metres that an IMU gives the map on the way; null where the
/// source has none. `teller` must outlive it.
std::unique_ptr<MetricWatch> WatchMetric(const LiveRun& live, const InertialOptions& options,
                                         AutopilotTeller* teller);

}  // namespace deepuav
