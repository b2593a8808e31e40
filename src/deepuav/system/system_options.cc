#include "deepuav/system/system_options.h"

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

/// Calls visit(prefix, part) for the structs of options that have a name of their own.
template <typename Options, typename Visitor>
void VisitParts(Options& options, Visitor&& visit) {
  visit("system", options);
  visit("patches", options.patches);
  visit("gaps", options.gaps);
  visit("bent_start", options.bent_start);
  visit("smoothing", options.smoothing);
  visit("readout", options.readout);
  visit("image_turns", options.image_turns);
  visit("tracking", options.tracking);
  visit("initialiser", options.tracking.initialiser);
  visit("keyframes", options.tracking.keyframes);
  visit("image_fixed", options.image_fixed);
  visit("mapping", options.mapping);
  visit("survey", options.survey);
  visit("looping", options.looping);
  visit("sensors", options.sensors);
}

}  // namespace

void SystemOptions::Check() const {
  VisitParts(*this, [](const char* prefix, const auto& part) { CheckOptions(prefix, part); });
}

void RegisterOptions(SystemOptions* options, OptionRegistry* registry) {
  VisitParts(*options, [&](const char* prefix, auto& part) { registry->Add(prefix, &part); });
}

}  // namespace deepuav
