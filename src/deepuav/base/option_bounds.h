#pragma once

#include <string>

#include "deepuav/base/error.h"
#include "deepuav/base/options.h"

namespace deepuav {

/// What CheckOption() throws.
class OptionError : public Error {
 public:
  /// `name` as in the registry, of which the part behind the last dot is the member's own.
  OptionError(const std::string& name, double found, const std::string& expected);

  /// The same of the member under another prefix.
  OptionError Under(const std::string& prefix) const;

 private:
  std::string member_;
  double found_;
  std::string expected_;
};

/// As CheckOption(), for a value from `low` to `high`, both allowed.
void CheckRange(const std::string& name, double found, double low, double high);

/// The same, for a value above 0 and at most `high`.
void CheckPositive(const std::string& name, double found, double high);

/// Calls options.Check() of a struct that is registered under `prefix`, and has its errors name
/// that: one type of struct may be registered more than once. Structs within it are called by
/// their own names only if they were checked before it.
template <typename Options>
void CheckUnder(const std::string& prefix, const Options& options) {
  try {
    options.Check();
  } catch (const OptionError& error) {
    throw error.Under(prefix);
  }
}

}  // namespace deepuav
