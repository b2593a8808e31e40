#include "deepuav/base/logging.h"

#include <spdlog/sinks/null_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

std::shared_ptr<spdlog::logger>& Logger() {
  static auto logger =
      std::make_shared<spdlog::logger>("deepuav", std::make_shared<spdlog::sinks::null_sink_mt>());
  return logger;
}

}  // namespace

spdlog::logger& Log() { return *Logger(); }

void LogToStderr(const std::string& level) {
  const spdlog::level::level_enum parsed = spdlog::level::from_str(level);
  if (parsed == spdlog::level::off && level != "off") {
    throw Error("log level is '{}': expected trace, debug, info, warn, error or off", level);
  }
  auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  sink->set_pattern("%^%l%$: %v");
  Logger() = std::make_shared<spdlog::logger>("deepuav", sink);
  Logger()->set_level(parsed);
}

}  // namespace deepuav
