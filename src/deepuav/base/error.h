#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace deepuav {

/// Bad input or wrong use. The message is one line that names the file, line or field, what was
/// found and what was expected; `main` prints it and exits non-zero. Estimators that find no
/// solution return std::optional instead.
class Error : public std::runtime_error {
 public:
  template <typename... Args>
  explicit Error(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(fmt::format(format, std::forward<Args>(args)...)) {}
};

}  // namespace deepuav
