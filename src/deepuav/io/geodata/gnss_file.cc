#include "deepuav/io/geodata/gnss_file.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/column_unit.h"
#include "deepuav/io/geodata/fix_table.h"
#include "deepuav/io/geodata/gpx_file.h"
#include "deepuav/io/geodata/iso_time.h"

namespace deepuav {
namespace {

constexpr size_t kFewestColumns = 3, kFewestPoseColumns = 8;
constexpr double kLowest_m = -12'000, kHighest_m = 1'000'000;
constexpr double kLargestSeconds = 9223372036;  // The last second of a 64-bit time stamp.

HeadLine FirstLine(const std::filesystem::path& file) {
  const std::vector<HeadLine> lines = FirstLines(file);
  return lines.empty() ? HeadLine() : lines.front();
}

bool IsGpx(const std::filesystem::path& file, std::string_view first_line) {
  return LowerCase(file.extension().string()) == ".gpx" || first_line.starts_with('<');
}

/// Where the columns are, and their units.
struct Columns {
  size_t time = 0;
  FixColumns fix;
  std::optional<int> places_of_second;  ///< Decimal ones; nothing where the head names no unit.
};

constexpr ColumnUnit<int> kPlacesOfSecond[] = {
    {"ns", 9}, {"nanosecond", 9},  {"us", 6}, {"microsecond", 6},
    {"ms", 3}, {"millisecond", 3}, {"s", 0},  {"second", 0}};

/// The columns by their names; nothing where the line names no latitude.
std::optional<Columns> ColumnsOfHead(std::string_view line) {
  TableRow names;
  SplitRow(line, &names);
  std::optional<size_t> time;
  Columns columns;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string name = LowerCase(names[i]);
    if (columns.fix.Take(name, i)) continue;
    if (!time && name.find("time") != std::string::npos) {
      time = i;
      columns.places_of_second = UnitOf(name, kPlacesOfSecond);
    }
  }
  if (!columns.fix.are_complete() || !time) return std::nullopt;
  columns.time = *time;
  return columns;
}

Timestamp ParseTime(std::string_view text, std::optional<int> places, const std::string& where) {
  if (LooksLikeIsoTime(text)) return ParseIsoTime(text, where);
  double number = 0;
  if (!places) places = IsNumber(text, &number) && std::abs(number) > kLargestSeconds ? 9 : 0;
  if (*places == 0) return ParseSeconds(text, where);
  if (*places == 9) return ParseNanoseconds(text, where);
  return ParseSeconds(fmt::format("{}e-{}", text, *places), where);
}

template <typename Take>
void VisitCsv(const std::filesystem::path& file, const HeadLine& first_line, Take&& take) {
  std::optional<Columns> columns = ColumnsOfHead(first_line.text);
  if (columns) columns->fix.CheckHead(first_line.text, file.string());
  const TextFile text(file);
  TableRow fields;
  for (size_t i = columns ? FirstRow(text, first_line) : 0; i < text.lines().size(); ++i) {
    const TextLine& line = text.lines()[i];
    const std::string where = text.Where(line);
    ReadRow(line.text, &fields, where);
    if (!columns) columns = Columns{0, FixColumns::ByPlace(fields.size()), {}};
    CheckFieldCount(fields, 1 + std::max(columns->time, columns->fix.last_needed()),
                    "time, latitude, longitude", where);
    const Timestamp time = ParseTime(fields[columns->time], columns->places_of_second, where);
    if (std::optional<GnssFix> fix = ParseFix(fields, columns->fix, where)) {
      fix->time = time;
      take(*fix, where);
    }
  }
}

}  // namespace

void CheckOnGlobe(const GnssFix& fix, const std::string& where) {
  constexpr double kPole = 90, kFullTurn = 360;
  if (!(std::abs(fix.latitude_deg) <= kPole)) {
    throw Error("{}: latitude is {}: expected -90 to 90 degrees", where, fix.latitude_deg);
  }
  if (!(std::abs(fix.longitude_deg) <= kFullTurn)) {
    throw Error("{}: longitude is {}: expected -180 to 180 degrees", where, fix.longitude_deg);
  }
  if (fix.altitude_m && !IsPossibleAltitude(*fix.altitude_m)) {
    throw Error("{}: altitude is {} m: expected {} to {}", where, *fix.altitude_m, kLowest_m,
                kHighest_m);
  }
}

bool IsPossibleAltitude(double altitude_m) {
  return altitude_m >= kLowest_m && altitude_m <= kHighest_m;
}

bool IsGnssFile(const std::filesystem::path& file) {
  const std::string first_line = FirstLine(file).text;
  if (IsGpx(file, first_line) || ColumnsOfHead(first_line)) return true;
  TableRow fields;
  SplitRow(first_line, &fields);
  double number = 0;
  return fields.size() >= kFewestColumns && fields.size() < kFewestPoseColumns &&
         (IsNumber(fields[0], &number) || HasDecimalComma(fields[0]) ||
          LooksLikeIsoTime(fields[0]));
}

std::vector<GnssFix> ReadGnssFile(const std::filesystem::path& file) {
  std::vector<GnssFix> fixes;
  const auto take = [&fixes](const GnssFix& fix, const std::string& where) {
    CheckOnGlobe(fix, where);
    if (fix.latitude_deg == 0 && fix.longitude_deg == 0)
      return;  // What receivers write before the first fix.
    if (!fixes.empty() && fix.time < fixes.back().time) {
      throw Error("{}: the time lies {} s before that of the fix before: expected growing times",
                  where, SecondsBetween(fix.time, fixes.back().time));
    }
    if (fixes.empty() || fixes.back().time < fix.time) fixes.push_back(fix);
  };
  const HeadLine first_line = FirstLine(file);
  if (IsGpx(file, first_line.text)) {
    VisitGpxPoints(file, take);
  } else {
    VisitCsv(file, first_line, take);
  }
  if (fixes.empty()) throw Error("{}: holds no position fix", file.string());
  return fixes;
}

}  // namespace deepuav
