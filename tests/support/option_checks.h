#pragma once

#include <charconv>
#include <string>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/options.h"

namespace deepuav {

/// Whether an entry holds a number: then it takes 0, or refuses it by its bounds, and no word.
inline bool IsNumeric(const OptionEntry& entry) {
  const std::string text = entry.get();
  double number = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  return status == std::errc() && end == text.data() + text.size();
}

template <typename Options>
std::vector<std::string> NumericNames() {
  Options options;
  OptionRegistry registry;
  options.Register(&registry);
  std::vector<std::string> names;
  for (const auto& [name, entry] : registry.entries())
    if (IsNumeric(entry)) names.push_back(name);
  return names;
}

/// What is said of the value; "accepted" where nothing is.
template <typename Options>
std::string ErrorOfSetting(Options options, const std::string& name, const std::string& value) {
  OptionRegistry registry;
  options.Register(&registry);
  try {
    registry.Set(name, value);
    options.Check();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace deepuav
