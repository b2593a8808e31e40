#include "deepuav/io/geodata/gnss_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <string>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/gpx_file.h"
#include "deepuav/io/geodata/iso_time.h"

namespace deepuav {
namespace {

using Fields = std::vector<std::string_view>;

constexpr size_t kHeadBytes = 4096;
constexpr size_t kFewestColumns = 3, kFewestPoseColumns = 8;
constexpr double kLowest_m = -12'000, kHighest_m = 1'000'000;
constexpr double kLargestSeconds = 9223372036;  // The last second of a 64-bit time stamp.
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return lower;
}

/// The first line that is not blank, without the '#' of a commented head.
std::string FirstLine(const std::filesystem::path& file) {
  const std::string head = ReadHead(file, kHeadBytes);
  std::string_view rest = head;
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  const size_t start = std::min(rest.find_first_not_of(" \t\r\n#"), rest.size());
  rest.remove_prefix(start);
  rest = rest.substr(0, rest.find_first_of("\r\n"));
  return std::string(rest.substr(0, rest.find_last_not_of(" \t") + 1));
}

bool IsGpx(const std::filesystem::path& file, std::string_view first_line) {
  return LowerCase(file.extension().string()) == ".gpx" || first_line.starts_with('<');
}

/// Where the columns are, and their units.
struct Columns {
  size_t time = 0, latitude = 1, longitude = 2;
  std::optional<size_t> altitude;
  std::array<std::optional<size_t>, 3> sigma;  ///< East, north, up, metres.
  std::optional<int> places_of_second;  ///< Decimal ones; nothing where the head names no unit.
  double altitude_unit_m = 1;
};

bool StartsWithAny(const std::string& name, std::initializer_list<const char*> starts) {
  return std::any_of(starts.begin(), starts.end(),
                     [&](const char* start) { return name.starts_with(start); });
}

template <typename Value>
struct Unit {
  std::string_view name;
  Value value;
};
constexpr Unit<int> kPlacesOfSecond[] = {{"ns", 9},          {"nanosecond", 9}, {"us", 6},
                                         {"microsecond", 6}, {"ms", 3},         {"millisecond", 3},
                                         {"s", 0},           {"second", 0}};
constexpr double kFoot_m = 0.3048;
constexpr Unit<double> kMetres[] = {{"m", 1},
                                    {"meter", 1},
                                    {"metre", 1},
                                    {"ft", kFoot_m},
                                    {"foot", kFoot_m},
                                    {"feet", kFoot_m},
                                    {"km", 1000},
                                    {"kilometer", 1000},
                                    {"kilometre", 1000},
                                    {"cm", 0.01},
                                    {"mm", 0.001},
                                    {"yd", 3 * kFoot_m},
                                    {"yard", 3 * kFoot_m}};

/// The fields of a row, separated by commas, or by semicolons where it has any; without the quotes
/// around them.
void SplitRow(std::string_view line, Fields* fields) {
  const char separator = line.find(';') == std::string_view::npos ? ',' : ';';
  fields->clear();
  while (true) {
    const size_t end = std::min(line.find(separator), line.size());
    std::string_view field = line.substr(0, end);
    const size_t first = std::min(field.find_first_not_of(" \t\""), field.size());
    field.remove_prefix(first);
    fields->push_back(field.substr(0, field.find_last_not_of(" \t\"") + 1));
    if (end == line.size()) return;
    line.remove_prefix(end + 1);
  }
}

/// The unit that a column's name ends with: the first word in brackets, or the word behind a space
/// or an underscore. Nothing where it names none that is known.
template <typename Value, size_t kCount>
std::optional<Value> UnitOf(std::string_view name, const Unit<Value> (&units)[kCount]) {
  std::string_view text = name;
  if (const size_t bracket = text.find_first_of("[({"); bracket != std::string_view::npos) {
    text.remove_prefix(bracket + 1);
    text = text.substr(0, text.find_first_of("])} "));
  } else if (const size_t gap = text.find_last_of(" _"); gap != std::string_view::npos) {
    text.remove_prefix(gap + 1);
  } else {
    return std::nullopt;
  }
  for (const Unit<Value>& unit : units) {
    if (text == unit.name || text == std::string(unit.name) + "s") return unit.value;
  }
  return std::nullopt;
}

/// Of which axis (east, north, up) a column holds the standard deviation, metres.
std::optional<size_t> AxisOfSigma(const std::string& name) {
  if (!StartsWithAny(name, {"std", "sigma"})) return std::nullopt;
  constexpr std::array<std::string_view, 3> kAxes = {"east", "north", "up"};
  for (size_t axis = 0; axis < kAxes.size(); ++axis) {
    if (name.find(kAxes[axis]) != std::string::npos) return axis;
  }
  return std::nullopt;
}

/// The columns by their names; nothing where the line names no latitude.
std::optional<Columns> ColumnsOfHead(std::string_view line) {
  Fields names;
  SplitRow(line, &names);
  std::optional<size_t> time, latitude, longitude, altitude;
  Columns columns;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string name = LowerCase(names[i]);
    if (!latitude && StartsWithAny(name, {"lat"})) {
      latitude = i;
    } else if (!longitude && StartsWithAny(name, {"lon", "lng"})) {
      longitude = i;
    } else if (const auto axis = AxisOfSigma(name)) {
      columns.sigma[*axis] = i;
    } else if (!altitude && StartsWithAny(name, {"alt", "ele", "height", "hgt"})) {
      altitude = i;
      columns.altitude_unit_m = UnitOf(name, kMetres).value_or(1);
    } else if (!time && name.find("time") != std::string::npos) {
      time = i;
      columns.places_of_second = UnitOf(name, kPlacesOfSecond);
    }
  }
  if (!latitude || !longitude || !time) return std::nullopt;
  columns.time = *time;
  columns.latitude = *latitude;
  columns.longitude = *longitude;
  columns.altitude = altitude;
  return columns;
}

bool IsAbsent(std::string_view field) { return field.empty() || LowerCase(field) == "nan"; }

Timestamp ParseTime(std::string_view text, std::optional<int> places, const std::string& where) {
  if (LooksLikeIsoTime(text)) return ParseIsoTime(text, where);
  double number = 0;
  if (!places) places = IsNumber(text, &number) && std::abs(number) > kLargestSeconds ? 9 : 0;
  if (*places == 0) return ParseSeconds(text, where);
  if (*places == 9) return ParseNanoseconds(text, where);
  return ParseSeconds(fmt::format("{}e-{}", text, *places), where);
}

/// What the receiver says of its accuracy; 0 where it says nothing.
double ParseSigma(const Fields& fields, std::optional<size_t> column, const std::string& where) {
  if (!column || *column >= fields.size() || IsAbsent(fields[*column])) return 0;
  return std::max(0.0, ParseFinite(fields[*column], where, "standard deviation"));
}

std::optional<GnssFix> ParseFix(const Fields& fields, const Columns& columns, Timestamp time,
                                const std::string& where) {
  if (IsAbsent(fields[columns.latitude]) || IsAbsent(fields[columns.longitude])) {
    return std::nullopt;
  }
  GnssFix fix;
  fix.time = time;
  fix.latitude_deg = ParseFinite(fields[columns.latitude], where, "latitude");
  fix.longitude_deg = ParseFinite(fields[columns.longitude], where, "longitude");
  if (columns.altitude && *columns.altitude < fields.size() &&
      !IsAbsent(fields[*columns.altitude])) {
    fix.altitude_m =
        columns.altitude_unit_m * ParseFinite(fields[*columns.altitude], where, "altitude");
  }
  for (int axis = 0; axis < 3; ++axis)
    fix.sigma_m[axis] = ParseSigma(fields, columns.sigma[static_cast<size_t>(axis)], where);
  return fix;
}

template <typename Take>
void VisitCsv(const std::filesystem::path& file, std::string_view first_line, Take&& take) {
  const std::optional<Columns> head = ColumnsOfHead(first_line);
  const TextFile text(file);
  Fields fields;
  std::optional<Columns> columns = head;
  // A head that is not commented out is a line of the text as well.
  const size_t first = head && !text.lines().empty() && text.lines()[0].text == first_line ? 1 : 0;
  for (size_t i = first; i < text.lines().size(); ++i) {
    const TextLine& line = text.lines()[i];
    const std::string where = text.Where(line);
    SplitRow(line.text, &fields);
    if (!columns) {
      columns = Columns{};
      if (fields.size() > kFewestColumns) columns->altitude = kFewestColumns;
    }
    const size_t needed = 1 + std::max({columns->time, columns->latitude, columns->longitude});
    if (fields.size() < needed) {
      throw Error("{}: {} fields: expected at least {} (time, latitude, longitude)", where,
                  fields.size(), needed);
    }
    const Timestamp time = ParseTime(fields[columns->time], columns->places_of_second, where);
    if (const std::optional<GnssFix> fix = ParseFix(fields, *columns, time, where)) {
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
  const std::string first_line = FirstLine(file);
  if (IsGpx(file, first_line) || ColumnsOfHead(first_line)) return true;
  Fields fields;
  SplitRow(first_line, &fields);
  double number = 0;
  return fields.size() >= kFewestColumns && fields.size() < kFewestPoseColumns &&
         (IsNumber(fields[0], &number) || LooksLikeIsoTime(fields[0]));
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
  const std::string first_line = FirstLine(file);
  if (IsGpx(file, first_line)) {
    VisitGpxPoints(file, take);
  } else {
    VisitCsv(file, first_line, take);
  }
  if (fixes.empty()) throw Error("{}: holds no position fix", file.string());
  return fixes;
}

}  // namespace deepuav
