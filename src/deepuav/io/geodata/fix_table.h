#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "deepuav/io/geodata/table_row.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

/// In which columns of a table a position stands, and its accuracy.
struct FixColumns {
  std::optional<size_t> latitude, longitude, altitude;
  std::array<std::optional<size_t>, 3> sigma;  ///< East, north, up, metres.
  double altitude_unit_m = 1;
  std::array<double, 3> sigma_unit_m = {1, 1, 1};
  std::string unit_fault = {};  ///< What CheckHead() has to say of units.

  /// Of a table without a head, by how many fields its first row has: latitude, longitude and
  /// altitude behind what the row is of.
  static FixColumns ByPlace(size_t count);
  /// Whether a column of this name (in lower case) belongs to a position; then it is taken.
  bool Take(const std::string& name, size_t column);
  /// Before the table under this head is read. Throws Error naming the column that was taken and is
  /// in a unit that is not known, and for a quote without end.
  void CheckHead(std::string_view line, const std::string& file) const;
  bool are_complete() const { return latitude && longitude; }
  /// Of the columns that every row must have.
  size_t last_needed() const { return std::max(*latitude, *longitude); }
};

/// Without a time. Nothing for a row without latitude or longitude. Throws Error for what is no
/// number.
std::optional<GnssFix> ParseFix(const TableRow& fields, const FixColumns& columns,
                                const std::string& where);

}  // namespace deepuav
