#include "deepuav/io/geodata/iso_time.h"

#include <charconv>
#include <chrono>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

constexpr size_t kDateLength = 10, kMinutesLength = 16;  // "2024-05-01", "2024-05-01T10:00"
constexpr size_t kZoneLength = 6;                        // "+02:00"
constexpr int64_t kNanosecondsPerSecond = 1000000000;

/// The digits [at, at + count) of `text` as a number of at most `most`.
std::optional<int> Digits(std::string_view text, size_t at, size_t count, int most) {
  if (text.size() < at + count) return std::nullopt;
  int value = 0;
  const char* begin = text.data() + at;
  const auto [stop, status] = std::from_chars(begin, begin + count, value);
  if (status != std::errc() || stop != begin + count || value < 0 || value > most) {
    return std::nullopt;
  }
  return value;
}

/// Takes the zone off the end of `text`: how far its clocks are ahead of UTC.
std::optional<std::chrono::minutes> TakeZone(std::string_view* text) {
  if (text->ends_with('Z') || text->ends_with('z')) {
    text->remove_suffix(1);
    return std::chrono::minutes(0);
  }
  if (text->size() < kMinutesLength + kZoneLength) return std::chrono::minutes(0);
  const std::string_view zone = text->substr(text->size() - kZoneLength);
  if (zone[0] != '+' && zone[0] != '-') return std::chrono::minutes(0);
  const auto hours = Digits(zone, 1, 2, 14), minutes = Digits(zone, 4, 2, 59);
  if (!hours || !minutes || zone[3] != ':') return std::nullopt;
  text->remove_suffix(kZoneLength);
  const std::chrono::minutes ahead = std::chrono::hours(*hours) + std::chrono::minutes(*minutes);
  return zone[0] == '+' ? ahead : -ahead;
}

std::optional<Timestamp> ReadIsoTime(std::string_view text, const std::string& where) {
  const std::optional<std::chrono::minutes> ahead = TakeZone(&text);
  const auto year = Digits(text, 0, 4, 9999), month = Digits(text, 5, 2, 12),
             day = Digits(text, 8, 2, 31), hour = Digits(text, 11, 2, 23),
             minute = Digits(text, 14, 2, 59);
  if (!ahead || !year || !month || !day || !hour || !minute) return std::nullopt;
  const std::chrono::year_month_day date(std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day)));
  if (!date.ok() || text[13] != ':' || (text[10] != 'T' && text[10] != ' ')) return std::nullopt;
  Timestamp second;
  if (text.size() > kMinutesLength) {
    if (text[kMinutesLength] != ':') return std::nullopt;
    second = ParseSeconds(text.substr(kMinutesLength + 1), where);
    if (second.nanoseconds < 0 || second.seconds() >= 61) return std::nullopt;
  }
  const auto whole = std::chrono::sys_days(date) + std::chrono::hours(*hour) +
                     std::chrono::minutes(*minute) - *ahead;
  const int64_t seconds =
      std::chrono::duration_cast<std::chrono::seconds>(whole.time_since_epoch()).count();
  constexpr int64_t kMostSeconds = 9000000000;  // Keeps nanoseconds within 64 bits.
  if (seconds < -kMostSeconds || seconds > kMostSeconds) return std::nullopt;
  return Timestamp{seconds * kNanosecondsPerSecond + second.nanoseconds};
}

}  // namespace

bool LooksLikeIsoTime(std::string_view text) {
  return text.size() > kDateLength && Digits(text, 0, 4, 9999) && text[4] == '-' &&
         text[7] == '-' && (text[kDateLength] == 'T' || text[kDateLength] == ' ');
}

Timestamp ParseIsoTime(std::string_view text, const std::string& where) {
  if (LooksLikeIsoTime(text)) {
    if (const std::optional<Timestamp> time = ReadIsoTime(text, where)) return *time;
  }
  throw Error("{}: time is {}: expected ISO 8601 as 2024-05-01T10:00:00.25Z", where, Quoted(text));
}

}  // namespace deepuav
