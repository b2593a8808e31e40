#pragma once

#include <string>

namespace deepuav {

/// What is said once of an autopilot's sensor.
struct AutopilotNews {
  std::string text;  ///< For STATUSTEXT.
  std::string why;   ///< More, for the log.
  bool is_warning = false;
};

}  // namespace deepuav
