#pragma once

#include <spdlog/spdlog.h>

namespace deepuav {

/// Libraries report through this logger and never print; the program decides where it goes. It is
/// silent until LogToStderr is called, as in tests.
spdlog::logger& Log();

/// Sends the log to stderr from `level` on. `level`: trace, debug, info, warn, error or off.
/// Throws Error for another name.
void LogToStderr(const std::string& level);

}  // namespace deepuav
