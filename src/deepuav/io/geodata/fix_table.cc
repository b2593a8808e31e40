#include "deepuav/io/geodata/fix_table.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

#include "deepuav/base/error.h"
#include "deepuav/io/geodata/column_unit.h"

namespace deepuav {
namespace {

constexpr double kFoot_m = 0.3048;
constexpr ColumnUnit<double> kMetres[] = {{"m", 1},
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
constexpr char kLengths[] = "m, km, cm, mm, ft or yd";
constexpr ColumnUnit<double> kDegrees[] = {{"deg", 1},      {"degree", 1},  {"\xC2\xB0", 1},
                                           {"\xC2\xBA", 1}, {"decimal", 1}, {"dd", 1},
                                           {"dec", 1}};

bool ContainsAny(const std::string& name, std::initializer_list<const char*> parts) {
  return std::any_of(parts.begin(), parts.end(),
                     [&](const char* part) { return name.find(part) != std::string::npos; });
}

bool StartsWithAny(const std::string& name, std::initializer_list<const char*> starts) {
  return std::any_of(starts.begin(), starts.end(),
                     [&](const char* start) { return name.starts_with(start); });
}

/// Whether one of the words stands in the name between what are no letters.
bool HasWord(const std::string& name, std::initializer_list<const char*> words) {
  std::string spaced = " " + name + " ";
  for (char& letter : spaced) {
    if (std::isalpha(static_cast<unsigned char>(letter)) == 0) letter = ' ';
  }
  return std::any_of(words.begin(), words.end(), [&](const char* word) {
    return spaced.find(std::string(" ") + word + " ") != std::string::npos;
  });
}

bool IsAngle(const std::string& name) {
  return ContainsAny(name, {"yaw", "pitch", "roll", "omega", "phi", "kappa"});
}

/// Which axes (0 east, 1 north, 2 up) a column holds the accuracy of.
std::vector<size_t> AxesOfSigma(const std::string& name) {
  constexpr size_t kEast = 0, kNorth = 1, kUp = 2;
  if (ContainsAny(name, {"vel", "speed", "deg"})) return {};
  if (HasWord(name, {"sde"})) return {kEast};
  if (HasWord(name, {"sdn"})) return {kNorth};
  if (HasWord(name, {"sdu"})) return {kUp};
  if (!StartsWithAny(name, {"std", "sigma"}) && !ContainsAny(name, {"accuracy", "stdev"}) &&
      !HasWord(name, {"std", "sigma", "rms", "precision"}))
    return {};
  if (ContainsAny(name, {"horiz", "lateral"}) || HasWord(name, {"horz", "hor", "xy"}) ||
      (HasWord(name, {"x"}) && HasWord(name, {"y"})))
    return {kEast, kNorth};
  if (ContainsAny(name, {"vert", "altitude", "height"}) || HasWord(name, {"up", "z", "alt"}) ||
      HasWord(name, {"stdup", "sigmaup"}))
    return {kUp};
  if (ContainsAny(name, {"east", "longitude"}) || HasWord(name, {"x", "lon"})) return {kEast};
  if (ContainsAny(name, {"north", "latitude"}) || HasWord(name, {"y", "lat"})) return {kNorth};
  return {};
}

bool IsAltitude(const std::string& name) {
  return StartsWithAny(
      name, {"alt", "ele", "height", "hgt", "ellips", "z/alt", "absolute alt", "absolutealt"});
}

bool IsAbsent(std::string_view field) { return field.empty() || LowerCase(field) == "nan"; }

bool IsGiven(const TableRow& fields, std::optional<size_t> column) {
  return column && *column < fields.size() && !IsAbsent(fields[*column]);
}

template <size_t kCount>
void CheckUnit(const std::string& name, const ColumnUnit<double> (&units)[kCount],
               const char* expected, std::string* fault) {
  const auto unknown = UnknownUnitOf(name, units);
  if (!unknown || !fault->empty()) return;
  *fault = fmt::format("column {} is in {}: expected {}", Quoted(name), Quoted(*unknown), expected);
}

}  // namespace

FixColumns FixColumns::ByPlace(size_t count) {
  constexpr size_t kLatitude = 1, kLongitude = 2, kAltitude = 3;
  FixColumns columns;
  columns.latitude = kLatitude;
  columns.longitude = kLongitude;
  if (count > kAltitude) columns.altitude = kAltitude;
  return columns;
}

bool FixColumns::Take(const std::string& name, size_t column) {
  if (IsAngle(name)) return false;
  if (const std::vector<size_t> axes = AxesOfSigma(name); !axes.empty()) {
    for (const size_t axis : axes) sigma[axis] = column;
    for (const size_t axis : axes) sigma_unit_m[axis] = UnitOf(name, kMetres).value_or(1);
  } else if (!latitude && StartsWithAny(name, {"lat", "y/lat"})) {
    latitude = column;
    CheckUnit(name, kDegrees, "degrees", &unit_fault);
  } else if (!longitude && StartsWithAny(name, {"lon", "lng", "x/lon"})) {
    longitude = column;
    CheckUnit(name, kDegrees, "degrees", &unit_fault);
  } else if (!altitude && IsAltitude(name)) {
    altitude = column;
    altitude_unit_m = UnitOf(name, kMetres).value_or(1);
    CheckUnit(name, kMetres, kLengths, &unit_fault);
  } else {
    return false;
  }
  return true;
}

void FixColumns::CheckHead(std::string_view line, const std::string& file) const {
  TableRow names;
  ReadRow(line, &names, file);
  if (!unit_fault.empty()) throw Error("{}: {}", file, unit_fault);
}

std::optional<GnssFix> ParseFix(const TableRow& fields, const FixColumns& columns,
                                const std::string& where) {
  if (!IsGiven(fields, columns.latitude) || !IsGiven(fields, columns.longitude))
    return std::nullopt;
  GnssFix fix;
  fix.latitude_deg = ParseFinite(fields[*columns.latitude], where, "latitude");
  fix.longitude_deg = ParseFinite(fields[*columns.longitude], where, "longitude");
  if (IsGiven(fields, columns.altitude)) {
    fix.altitude_m =
        columns.altitude_unit_m * ParseFinite(fields[*columns.altitude], where, "altitude");
  }
  for (size_t axis = 0; axis < columns.sigma.size(); ++axis) {
    if (!IsGiven(fields, columns.sigma[axis])) continue;
    fix.sigma_m[static_cast<Eigen::Index>(axis)] =
        columns.sigma_unit_m[axis] *
        std::max(0.0, ParseFinite(fields[*columns.sigma[axis]], where, "standard deviation"));
  }
  return fix;
}

}  // namespace deepuav
