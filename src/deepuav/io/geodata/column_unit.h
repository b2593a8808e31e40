#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace deepuav {

template <typename Value>
struct ColumnUnit {
  std::string_view name;
  Value value;
};

/// A word of a column's name that may be its unit.
struct UnitWord {
  std::string text;
  bool is_in_brackets = false;
};

/// The words in brackets, and behind them that which what stands before the brackets ends with
/// behind a space or an underscore. `name` is in lower case.
std::vector<UnitWord> UnitWordsOf(std::string_view name);

/// Whether the word is no unit because it tells what a height or angle counts from ("amsl",
/// "wgs84", "above takeoff"), or what it is of.
bool TellsReference(std::string_view word);

/// Whether the word is a unit of lengths or angles, where it need not be one.
bool IsOtherUnit(std::string_view word);

template <typename Value, size_t kCount>
std::optional<Value> ValueOf(std::string_view word, const ColumnUnit<Value> (&units)[kCount]) {
  for (const ColumnUnit<Value>& unit : units) {
    if (word == unit.name || word == std::string(unit.name) + "s") return unit.value;
  }
  return std::nullopt;
}

/// The unit that a column's name tells. Nothing where it names none that is known.
template <typename Value, size_t kCount>
std::optional<Value> UnitOf(std::string_view name, const ColumnUnit<Value> (&units)[kCount]) {
  for (const UnitWord& word : UnitWordsOf(name)) {
    if (const auto value = ValueOf(word.text, units)) return value;
  }
  return std::nullopt;
}

/// The word of a column's name that is a unit, but none of those known.
template <typename Value, size_t kCount>
std::optional<std::string> UnknownUnitOf(std::string_view name,
                                         const ColumnUnit<Value> (&units)[kCount]) {
  for (const UnitWord& word : UnitWordsOf(name)) {
    if (ValueOf(word.text, units)) continue;
    if (word.is_in_brackets ? !TellsReference(word.text) : IsOtherUnit(word.text)) return word.text;
  }
  return std::nullopt;
}

}  // namespace deepuav
