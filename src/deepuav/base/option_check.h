#pragma once

#include <string>

#include "deepuav/base/error.h"
#include "deepuav/base/option_bounds.h"

namespace deepuav {

/// An option that cannot be what it is.
class OptionError : public Error {
 public:
  /// `found`: the value, as in "is 5".
  OptionError(const std::string& name, const std::string& found, const std::string& expected);

  /// The same of an option of a struct that is registered under `prefix`.
  OptionError Under(const std::string& prefix) const;

 private:
  std::string name_, found_, expected_;
};

/// "prefix.name", or the one that is not empty.
std::string JoinOptionName(const std::string& prefix, const std::string& name);

/// Throws OptionError unless `holds`: for what relates two options of a struct. `name`: the
/// member's, without that under which the struct is registered.
void CheckOption(bool holds, const std::string& name, double found, const std::string& expected);

template <typename Options>
void CheckOptions(const std::string& prefix, Options options);

/// Throws OptionError for the first value beyond the bounds that it is visited with.
class OptionChecker {
 public:
  explicit OptionChecker(const std::string& prefix) : prefix_(prefix) {}

  void operator()(const std::string&, bool&, const std::string&, const std::string&) const {}
  void operator()(const std::string& name, const int& value, const std::string&, const std::string&,
                  const NumberBounds& bounds) const {
    CheckNumber(name, value, bounds);
  }
  void operator()(const std::string& name, const double& value, const std::string&,
                  const std::string&, const NumberBounds& bounds) const {
    CheckNumber(name, value, bounds);
  }
  void operator()(const std::string& name, const std::string& value, const std::string&,
                  const std::string&, const TextBounds& bounds = AnyText()) const {
    CheckText(name, value, bounds);
  }
  template <typename Options>
  void Part(const std::string& name, const Options& part) const {
    CheckOptions(JoinOptionName(prefix_, name), part);
  }

 private:
  void CheckNumber(const std::string& name, double value, const NumberBounds& bounds) const;
  void CheckText(const std::string& name, const std::string& value, const TextBounds& bounds) const;

  std::string prefix_;
};

/// Holds all that `options` visits against its bounds, the structs within them included, and then
/// what the struct's CheckRelations() says, if it has one. Throws OptionError that names the option
/// as it is registered under `prefix`.
template <typename Options>
void CheckOptions(const std::string& prefix, Options options) {
  options.Visit(OptionChecker(prefix));
  if constexpr (requires { options.CheckRelations(); }) {
    try {
      options.CheckRelations();
    } catch (const OptionError& error) {
      throw error.Under(prefix);
    }
  }
}

}  // namespace deepuav
