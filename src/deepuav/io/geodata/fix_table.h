#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/io/files/text_file.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

using TableRow = std::vector<std::string_view>;

/// The fields of a line, without the quotes around them: separated by semicolons where it has any,
/// else by commas, else by tabs.
void SplitRow(std::string_view line, TableRow* fields);

/// Throws Error where a row has fewer than `needed` fields; `names` says which these are.
void CheckFieldCount(const TableRow& fields, size_t needed, const char* names,
                     const std::string& where);

struct HeadLine {
  std::string text;  ///< Without the '#' of a comment.
  bool is_comment = false;
};

/// The first lines of a file that are not blank, comments too, as heads are often written as these.
std::vector<HeadLine> FirstLines(const std::filesystem::path& file);

/// The index of the first row: behind the head, where that is a line of the text.
size_t FirstRow(const TextFile& text, const HeadLine& head);

std::string LowerCase(std::string_view text);

template <typename Value>
struct ColumnUnit {
  std::string_view name;
  Value value;
};

/// The unit that a column's name ends with: the first word in brackets, or the word behind a space
/// or an underscore. Nothing where it names none that is known.
template <typename Value, size_t kCount>
std::optional<Value> UnitOf(std::string_view name, const ColumnUnit<Value> (&units)[kCount]) {
  std::string_view text = name;
  if (const size_t bracket = text.find_first_of("[({"); bracket != std::string_view::npos) {
    text.remove_prefix(bracket + 1);
    text = text.substr(0, text.find_first_of("])} "));
  } else if (const size_t gap = text.find_last_of(" _"); gap != std::string_view::npos) {
    text.remove_prefix(gap + 1);
  } else {
    return std::nullopt;
  }
  for (const ColumnUnit<Value>& unit : units) {
    if (text == unit.name || text == std::string(unit.name) + "s") return unit.value;
  }
  return std::nullopt;
}

/// In which columns of a table a position stands, and its accuracy.
struct FixColumns {
  std::optional<size_t> latitude, longitude, altitude;
  std::array<std::optional<size_t>, 3> sigma;  ///< East, north, up, metres.
  double altitude_unit_m = 1, sigma_unit_m = 1;

  /// Of a table without a head, by how many fields its first row has: latitude, longitude and
  /// altitude behind what the row is of.
  static FixColumns ByPlace(size_t count);
  /// Whether a column of this name (in lower case) belongs to a position; then it is taken.
  bool Take(const std::string& name, size_t column);
  bool are_complete() const { return latitude && longitude; }
  /// Of the columns that every row must have.
  size_t last_needed() const { return std::max(*latitude, *longitude); }
};

/// Without a time. Nothing for a row without latitude or longitude. Throws Error for what is no
/// number.
std::optional<GnssFix> ParseFix(const TableRow& fields, const FixColumns& columns,
                                const std::string& where);

}  // namespace deepuav
