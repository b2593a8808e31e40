#include "deepuav/survey/survey_options.h"

#include <algorithm>
#include <thread>

#include "deepuav/base/option_check.h"

namespace deepuav {

void SurveyOptions::Check() const { CheckOptions("survey", *this); }

int ThreadsOf(const SurveyOptions& options) {
  const auto cores = static_cast<int>(std::thread::hardware_concurrency());
  constexpr int kMost = 64;
  return std::clamp(options.threads > 0 ? options.threads : cores, 1, kMost);
}

}  // namespace deepuav
