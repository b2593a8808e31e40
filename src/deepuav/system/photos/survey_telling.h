#pragma once

#include <functional>
#include <string>

#include "deepuav/base/time.h"
#include "deepuav/survey/survey_mapper.h"
#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

/// Tells an observer of the photographs of a survey, and of its maps: of those as they grow now and
/// then, of what they are in the end once.
class SurveyTelling : public SurveyWatch {
 public:
  /// How many of `what` (a plural) are done.
  using Work = std::function<void(const std::string& what, int done, int total)>;

  /// Both may be null; the observer must outlive it.
  SurveyTelling(RunObserver* observer, Work work) : observer_(observer), work_(std::move(work)) {}

  /// What was read; its features are there.
  void TellOfPhotograph(const Frame& frame);
  void TellOfMaps(const Atlas& atlas);

  void OnWork(const char* what, int done, int total) override;
  void OnGrowth(MapId map, const SurveyState& state) override;

 private:
  RunObserver* const observer_;
  const Work work_;
  Stopwatch since_sketch_;
  bool was_sketched_ = false;
};

}  // namespace deepuav
