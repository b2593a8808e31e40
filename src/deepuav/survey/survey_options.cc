#include "deepuav/survey/survey_options.h"

#include <algorithm>

#include "deepuav/base/option_check.h"
#include "deepuav/base/parallel.h"

namespace deepuav {

void SurveyOptions::Check() const { CheckOptions("survey", *this); }

void SurveyOptions::CheckRelations() const {
  CheckOption(max_unsettled_sigmas >= max_patch_sigmas, "max_unsettled_sigmas",
              max_unsettled_sigmas, "at least max_patch_sigmas");
}

int ThreadsOf(const SurveyOptions& options) {
  constexpr int kMost = 64;
  return std::clamp(options.threads > 0 ? options.threads : CoreCount(), 1, kMost);
}

}  // namespace deepuav
