#include "deepuav/base/options.h"

#include <charconv>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/nearest_name.h"

namespace deepuav {
namespace {

template <typename Number>
Number ParseNumber(const std::string& name, const std::string& text, const char* expected) {
  Number number{};
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (status != std::errc() || end != text.data() + text.size()) {
    throw Error("option {} is '{}': expected {}", name, text, expected);
  }
  return number;
}

double ParseFinite(const std::string& name, const std::string& text) {
  const double number = ParseNumber<double>(name, text, "a number");
  if (!std::isfinite(number))
    throw Error("option {} is '{}': expected a finite number", name, text);
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
  std::vector<std::string> known;
  for (const auto& [known_name, entry] : entries_) known.push_back(known_name);
  const std::string nearest = NearestName(name, known);
  throw Error("unknown option '{}'{}", name,
              nearest.empty() ? "" : ": the nearest known one is '" + nearest + "'");
}

void OptionRegistry::SetAssignment(const std::string& assignment) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error("'{}' is no assignment: expected name=value", assignment);
  }
  Set(assignment.substr(0, equals), assignment.substr(equals + 1));
}

void OptionRegistry::AddValue(const std::string& name, bool* value, OptionEntry entry) {
  entry.set = [=](const std::string& text) { *value = ParseBool(name, text); };
  entry.get = [=] { return std::string(*value ? "true" : "false"); };
  entries_[name] = std::move(entry);
}

void OptionRegistry::AddValue(const std::string& name, int* value, OptionEntry entry,
                              const NumberBounds& bounds) {
  entry.bounds = bounds.Text();
  entry.set = [=](const std::string& text) {
    *value = ParseNumber<int>(name, text, "a whole number");
  };
  entry.get = [=] { return std::to_string(*value); };
  entries_[name] = std::move(entry);
}

void OptionRegistry::AddValue(const std::string& name, double* value, OptionEntry entry,
                              const NumberBounds& bounds) {
  entry.bounds = bounds.Text();
  entry.set = [=](const std::string& text) { *value = ParseFinite(name, text); };
  entry.get = [=] { return fmt::format("{}", *value); };
  entries_[name] = std::move(entry);
}

void OptionRegistry::AddValue(const std::string& name, std::string* value, OptionEntry entry,
                              const TextBounds& bounds) {
  entry.bounds = bounds.words.empty() ? "" : bounds.Text();
  entry.set = [=](const std::string& text) { *value = text; };
  entry.get = [=] { return *value; };
  entries_[name] = std::move(entry);
}

}  // namespace deepuav
