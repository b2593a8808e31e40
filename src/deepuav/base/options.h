#pragma once

#include <concepts>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace deepuav {

/// One settable value of an options struct.
struct OptionEntry {
  std::string unit;     ///< "px", "m", "s", "" for counts and ratios.
  std::string meaning;  ///< One line.
  std::function<void(const std::string& text)> set;
  std::function<std::string()> get;
};

/// The settable values of a program by dotted name ("tracking.keypoints"). Options structs list
/// their members in `template <typename Visitor> void Visit(Visitor&& visit)`, calling `visit(name,
/// member, unit, meaning)` for each. The registry refers to the structs, which must outlive it. Not
/// thread-safe.
class OptionRegistry {
 public:
  /// Adds the members of `options` under `prefix`.
  template <typename Options>
  void Add(const std::string& prefix, Options* options) {
    options->Visit(
        [&](const std::string& name, auto& value, const std::string& unit,
            const std::string& meaning) { AddValue(prefix + "." + name, &value, unit, meaning); });
  }

  /// Sets one value from its text. Throws Error for an unknown name (naming the nearest known one)
  /// and for a text that is no value of the option's type.
  void Set(const std::string& name, const std::string& text);

  /// Sets from "name=value", as given to --set.
  void SetAssignment(const std::string& assignment);

  const std::map<std::string, OptionEntry>& entries() const { return entries_; }

 private:
  void AddValue(const std::string& name, bool* value, const std::string& unit,
                const std::string& meaning);
  void AddValue(const std::string& name, int* value, const std::string& unit,
                const std::string& meaning);
  void AddValue(const std::string& name, double* value, const std::string& unit,
                const std::string& meaning);
  void AddValue(const std::string& name, std::string* value, const std::string& unit,
                const std::string& meaning);

  std::map<std::string, OptionEntry> entries_;
};

/// Throws Error unless `holds`; for the Check() of options structs: `name` as in the registry,
/// `found` its value.
void CheckOption(bool holds, const std::string& name, double found, const std::string& expected);

}  // namespace deepuav
