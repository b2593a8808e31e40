#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/system/slam.h"

namespace deepuav {
namespace {

/// Calls visit(prefix, part) for the structs of options that have a name of their own.
template <typename Options, typename Visitor>
void VisitParts(Options& options, Visitor&& visit) {
  visit("system", options);
  visit("patches", options.patches);
  visit("gaps", options.gaps);
  visit("tracking", options.tracking);
  visit("initialiser", options.tracking.initialiser);
  visit("keyframes", options.tracking.keyframes);
  visit("mapping", options.mapping);
  visit("survey", options.survey);
  visit("looping", options.looping);
  visit("sensors", options.sensors);
}

}  // namespace

Schedule ParseSchedule(const std::string& name) {
  if (name == "sequential") return Schedule::kSequential;
  if (name == "threaded") return Schedule::kThreaded;
  if (name == "live") return Schedule::kLive;
  throw Error("schedule is '{}': expected sequential, threaded or live", name);
}

void SystemOptions::Check() const {
  VisitParts(*this, [](const char* prefix, const auto& part) { CheckOptions(prefix, part); });
}

void RegisterOptions(SystemOptions* options, OptionRegistry* registry) {
  VisitParts(*options, [&](const char* prefix, auto& part) { registry->Add(prefix, &part); });
}

}  // namespace deepuav
