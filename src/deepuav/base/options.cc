#include "deepuav/base/options.h"

#include <algorithm>
#include <charconv>
#include <numeric>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

int EditDistance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const int substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

template <typename Number>
Number ParseNumber(const std::string& name, const std::string& text, const char* expected) {
  Number number{};
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (status != std::errc() || end != text.data() + text.size()) {
    throw Error("option {} is '{}': expected {}", name, text, expected);
  }
  return number;
}

bool ParseBool(const std::string& name, const std::string& text) {
  if (text == "true" || text == "1" || text == "yes" || text == "on") return true;
  if (text == "false" || text == "0" || text == "no" || text == "off") return false;
  throw Error("option {} is '{}': expected true or false", name, text);
}

}  // namespace

void OptionRegistry::Set(const std::string& name, const std::string& text) {
  const auto found = entries_.find(name);
  if (found != entries_.end()) {
    found->second.set(text);
    return;
  }
  const auto nearest =
      std::min_element(entries_.begin(), entries_.end(), [&](const auto& a, const auto& b) {
        return EditDistance(a.first, name) < EditDistance(b.first, name);
      });
  throw Error(
      "unknown option '{}'{}", name,
      nearest == entries_.end() ? "" : ": the nearest known one is '" + nearest->first + "'");
}

void OptionRegistry::SetAssignment(const std::string& assignment) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error("'{}' is no assignment: expected name=value", assignment);
  }
  Set(assignment.substr(0, equals), assignment.substr(equals + 1));
}

void OptionRegistry::AddValue(const std::string& name, bool* value, const std::string& unit,
                              const std::string& meaning) {
  entries_[name] = {unit, meaning, [=](const std::string& text) { *value = ParseBool(name, text); },
                    [=] { return std::string(*value ? "true" : "false"); }};
}

void OptionRegistry::AddValue(const std::string& name, int* value, const std::string& unit,
                              const std::string& meaning) {
  entries_[name] = {
      unit, meaning,
      [=](const std::string& text) { *value = ParseNumber<int>(name, text, "a whole number"); },
      [=] { return std::to_string(*value); }};
}

void OptionRegistry::AddValue(const std::string& name, double* value, const std::string& unit,
                              const std::string& meaning) {
  entries_[name] = {
      unit, meaning,
      [=](const std::string& text) { *value = ParseNumber<double>(name, text, "a number"); },
      [=] { return fmt::format("{}", *value); }};
}

void OptionRegistry::AddValue(const std::string& name, std::string* value, const std::string& unit,
                              const std::string& meaning) {
  entries_[name] = {unit, meaning, [=](const std::string& text) { *value = text; },
                    [=] { return *value; }};
}

void CheckOption(bool holds, const std::string& name, double found, const std::string& expected) {
  if (!holds) throw Error("option {} is {}: expected {}", name, found, expected);
}

}  // namespace deepuav
