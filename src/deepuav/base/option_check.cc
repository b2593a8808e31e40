#include "deepuav/base/option_check.h"

namespace deepuav {

OptionError::OptionError(const std::string& name, const std::string& found,
                         const std::string& expected)
    : Error("option {} is {}: expected {}", name, found, expected),
      name_(name),
      found_(found),
      expected_(expected) {}

OptionError OptionError::Under(const std::string& prefix) const {
  return {JoinOptionName(prefix, name_), found_, expected_};
}

std::string JoinOptionName(const std::string& prefix, const std::string& name) {
  if (prefix.empty() || name.empty()) return prefix + name;
  return prefix + "." + name;
}

void CheckOption(bool holds, const std::string& name, double found, const std::string& expected) {
  if (!holds) throw OptionError(name, fmt::format("{}", found), expected);
}

void OptionChecker::CheckNumber(const std::string& name, double value,
                                const NumberBounds& bounds) const {
  CheckOption(bounds.Hold(value), JoinOptionName(prefix_, name), value, bounds.Text());
}

void OptionChecker::CheckText(const std::string& name, const std::string& value,
                              const TextBounds& bounds) const {
  if (bounds.Hold(value)) return;
  throw OptionError(JoinOptionName(prefix_, name),
                    value.empty() && bounds.words.empty() ? "empty" : "'" + value + "'",
                    bounds.Text());
}

}  // namespace deepuav
