#include "deepuav/base/option_bounds.h"

namespace deepuav {

OptionError::OptionError(const std::string& name, double found, const std::string& expected)
    : Error("option {} is {}: expected {}", name, found, expected),
      member_(name.substr(name.rfind('.') + 1)),
      found_(found),
      expected_(expected) {}

OptionError OptionError::Under(const std::string& prefix) const {
  return {prefix + "." + member_, found_, expected_};
}

void CheckRange(const std::string& name, double found, double low, double high) {
  CheckOption(found >= low && found <= high, name, found, fmt::format("{} to {}", low, high));
}

void CheckPositive(const std::string& name, double found, double high) {
  CheckOption(found > 0 && found <= high, name, found,
              fmt::format("more than 0, at most {}", high));
}

}  // namespace deepuav
