#pragma once

#include "deepuav/base/ids.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// Hears how far the making of a survey's maps is, in its thread. Nothing that is told changes it.
class SurveyWatch {
 public:
  virtual ~SurveyWatch() = default;
  /// So many of all `what` (a plural) are done; the next kind of work begins anew.
  virtual void OnWork(const char* what, int done, int total) = 0;
  /// A photograph was added to the map: to be read during the call only.
  virtual void OnGrowth(MapId map, const SurveyState& state) = 0;
};

}  // namespace deepuav
