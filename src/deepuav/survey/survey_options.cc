#include "deepuav/survey/survey_options.h"

#include "deepuav/base/option_check.h"

namespace deepuav {

void SurveyOptions::Check() const { CheckOptions("survey", *this); }

}  // namespace deepuav
