#include "deepuav/io/geodata/srt_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/gnss_file.h"

namespace deepuav {
namespace {

constexpr size_t kMaxBytes = size_t{256} << 20;
constexpr std::string_view kArrow = "-->";

struct Subtitle {
  Timestamp time;
  std::string text;  ///< Lower case, without tags.
  int64_t line = 0;  ///< Of its time.
};

std::string LowerWithoutTags(std::string_view text) {
  std::string plain;
  bool in_tag = false;
  for (const char letter : text) {
    if (letter == '<') in_tag = true;
    if (!in_tag) plain += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    if (letter == '>' || letter == '\n') in_tag = false;
  }
  return plain;
}

bool IsDigit(char letter) { return letter >= '0' && letter <= '9'; }

/// "HH:MM:SS,mmm" or with a point.
std::optional<Timestamp> ParseCueTime(std::string_view text) {
  int64_t parts[4] = {};
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at != end && !IsDigit(*at)) ++at;
  for (int i = 0; i < 4; ++i) {
    const auto [next, status] = std::from_chars(at, end, parts[i]);
    if (status != std::errc() || parts[i] < 0 || parts[i] > 999) return std::nullopt;
    if (i == 3) break;
    if (next == end || (i < 2 ? *next != ':' : *next != ',' && *next != '.')) return std::nullopt;
    at = next + 1;
  }
  const int64_t milliseconds = ((parts[0] * 60 + parts[1]) * 60 + parts[2]) * 1000 + parts[3];
  return Timestamp{milliseconds * 1000000};
}

std::vector<Subtitle> ReadSubtitles(std::string_view bytes) {
  std::vector<Subtitle> subtitles;
  int64_t number = 0;
  while (!bytes.empty()) {
    ++number;
    const size_t end = std::min(bytes.find('\n'), bytes.size());
    const std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
    const size_t arrow = line.find(kArrow);
    const auto time =
        arrow == std::string_view::npos ? std::nullopt : ParseCueTime(line.substr(0, arrow));
    if (time) {
      subtitles.push_back({*time, "", number});
    } else if (!subtitles.empty()) {
      subtitles.back().text.append(line).push_back('\n');
    }
  }
  for (Subtitle& subtitle : subtitles) subtitle.text = LowerWithoutTags(subtitle.text);
  return subtitles;
}

/// The finite number that the text begins with, after blanks.
std::optional<double> LeadingNumber(std::string_view text) {
  const size_t start = std::min(text.find_first_not_of(" \t"), text.size());
  text.remove_prefix(start);
  if (text.starts_with('+')) text.remove_prefix(1);
  double number = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (status != std::errc() || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// The number behind "key :", where the key is a word of its own.
std::optional<double> NumberOf(std::string_view text, std::string_view key) {
  for (size_t at = text.find(key); at != std::string_view::npos; at = text.find(key, at + 1)) {
    if (at > 0 && (std::isalpha(static_cast<unsigned char>(text[at - 1])) || text[at - 1] == '_'))
      continue;
    std::string_view rest = text.substr(at + key.size());
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
    if (!rest.starts_with(':')) continue;
    if (const auto number = LeadingNumber(rest.substr(1))) return number;
  }
  return std::nullopt;
}

std::optional<double> FirstOf(std::string_view text, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (const auto number = NumberOf(text, key)) return number;
  }
  return std::nullopt;
}

/// Longitude and latitude of "gps(longitude, latitude, ...)".
std::optional<std::pair<double, double>> ParseGpsBrackets(std::string_view text) {
  const size_t at = text.find("gps");
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view rest = text.substr(at + 3);
  rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
  if (!rest.starts_with('(')) return std::nullopt;
  rest.remove_prefix(1);
  const size_t comma = rest.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  const auto first = LeadingNumber(rest), second = LeadingNumber(rest.substr(comma + 1));
  if (!first || !second) return std::nullopt;
  return std::pair(*first, *second);
}

/// The height of ", H 6.00m".
std::optional<double> ParseHeight(std::string_view text) {
  const size_t at = text.find(", h ");
  return at == std::string_view::npos ? std::nullopt : LeadingNumber(text.substr(at + 4));
}

std::optional<GnssFix> ParseFix(const Subtitle& subtitle) {
  GnssFix fix;
  fix.time = subtitle.time;
  const std::string& text = subtitle.text;
  const auto latitude = NumberOf(text, "latitude");
  const auto longitude = FirstOf(text, {"longitude", "longtitude"});
  if (latitude && longitude) {
    fix.latitude_deg = *latitude;
    fix.longitude_deg = *longitude;
  } else if (const auto gps = ParseGpsBrackets(text)) {
    std::tie(fix.longitude_deg, fix.latitude_deg) = *gps;
  } else {
    return std::nullopt;
  }
  if (fix.latitude_deg == 0 && fix.longitude_deg == 0) return std::nullopt;
  fix.altitude_m = FirstOf(text, {"abs_alt", "altitude", "rel_alt", "barometer"});
  if (!fix.altitude_m) fix.altitude_m = ParseHeight(text);
  return fix;
}

bool SamePlace(const GnssFix& a, const GnssFix& b) {
  return a.latitude_deg == b.latitude_deg && a.longitude_deg == b.longitude_deg &&
         a.altitude_m == b.altitude_m;
}

}  // namespace

std::vector<GnssFix> ReadSrtFile(const std::filesystem::path& file) {
  const std::string bytes = ReadBytes(file, kMaxBytes);
  const std::vector<Subtitle> subtitles = ReadSubtitles(bytes);
  if (subtitles.empty())
    throw Error("{}: holds no subtitle: expected 'HH:MM:SS,mmm --> HH:MM:SS,mmm' lines",
                file.string());
  std::vector<GnssFix> fixes;
  for (const Subtitle& subtitle : subtitles) {
    const std::optional<GnssFix> fix = ParseFix(subtitle);
    if (!fix) continue;
    constexpr double kPole = 90, kHalfTurn = 180;
    if (std::abs(fix->latitude_deg) > kPole || std::abs(fix->longitude_deg) > kHalfTurn) {
      throw Error("{}:{}: latitude {}, longitude {}: expected -90 to 90 and -180 to 180 degrees",
                  file.string(), subtitle.line, fix->latitude_deg, fix->longitude_deg);
    }
    if (fix->altitude_m && !IsPossibleAltitude(*fix->altitude_m)) {
      throw Error("{}:{}: altitude {} m: expected that of a flight", file.string(), subtitle.line,
                  *fix->altitude_m);
    }
    if (!fixes.empty() && (SamePlace(fixes.back(), *fix) || fix->time <= fixes.back().time))
      continue;
    fixes.push_back(*fix);
  }
  return fixes;
}

}  // namespace deepuav
