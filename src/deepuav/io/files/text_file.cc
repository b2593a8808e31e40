#include "deepuav/io/files/text_file.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"

namespace deepuav {
namespace {

constexpr size_t kMaxTextBytes = size_t{256} << 20;
constexpr size_t kMaxQuotedLength = 80;
constexpr std::string_view kBlanks = " \t\r\v\f";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::string_view Trim(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// A decimal number as text: the value is 0.DIGITS * 10^point.
struct Decimal {
  bool negative = false;
  std::string digits;
  int64_t point = 0;
};

std::optional<Decimal> SplitDecimal(std::string_view text) {
  Decimal decimal;
  size_t i = 0;
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) decimal.negative = text[i++] == '-';
  for (; i < text.size() && IsDigit(text[i]); ++i) decimal.digits += text[i];
  decimal.point = static_cast<int64_t>(decimal.digits.size());
  if (i < text.size() && text[i] == '.') {
    for (++i; i < text.size() && IsDigit(text[i]); ++i) decimal.digits += text[i];
  }
  if (decimal.digits.empty()) return std::nullopt;
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    ++i;
    if (i < text.size() && text[i] == '+') ++i;
    int exponent = 0;
    const char* end = text.data() + text.size();
    const auto [stop, status] = std::from_chars(text.data() + i, end, exponent);
    if (status != std::errc() || stop != end) return std::nullopt;
    decimal.point += exponent;
    i = text.size();
  }
  if (i != text.size()) return std::nullopt;
  const size_t zeros = std::min(decimal.digits.find_first_not_of('0'), decimal.digits.size());
  decimal.digits.erase(0, zeros);
  decimal.point -= static_cast<int64_t>(zeros);
  return decimal;
}

// text * 10^shift, rounded to the nearest integer, halves away from zero; nothing where it does not
// fit.
std::optional<int64_t> ParseScaled(std::string_view text, int shift) {
  const std::optional<Decimal> decimal = SplitDecimal(text);
  if (!decimal) return std::nullopt;
  const int64_t whole_digits = decimal->point + shift;
  if (decimal->digits.empty() || whole_digits < 0) return 0;
  constexpr int64_t kMaxDigits = 19;  // of int64
  if (whole_digits > kMaxDigits) return std::nullopt;
  uint64_t value = 0;  // 10^19 < 2^64
  for (int64_t i = 0; i < whole_digits; ++i) {
    const bool given = i < static_cast<int64_t>(decimal->digits.size());
    value = value * 10 +
            (given ? static_cast<uint64_t>(decimal->digits[static_cast<size_t>(i)] - '0') : 0);
  }
  const auto next = static_cast<size_t>(whole_digits);
  if (next < decimal->digits.size() && decimal->digits[next] >= '5') ++value;
  if (value > static_cast<uint64_t>(std::numeric_limits<int64_t>::max())) return std::nullopt;
  const auto magnitude = static_cast<int64_t>(value);
  return decimal->negative ? -magnitude : magnitude;
}

const char* PointHint(std::string_view text) {
  return HasDecimalComma(text) ? " with a decimal point, not a comma" : "";
}

}  // namespace

std::string ReadHead(const std::filesystem::path& file, size_t max_bytes) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw Error("{}: is a folder: expected a file", file.string());
  }
  RefuseNamedPipe(file);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"),
                                                               &std::fclose);
  if (!stream) throw Error("{}: cannot be opened: {}", file.string(), std::strerror(errno));
  std::string bytes;
  constexpr size_t kBlockBytes = size_t{64} << 10;
  size_t count = 1;
  while (count > 0 && bytes.size() < max_bytes) {
    const size_t before = bytes.size();
    bytes.resize(before + std::min(kBlockBytes, max_bytes - before));
    count = std::fread(bytes.data() + before, 1, bytes.size() - before, stream.get());
    bytes.resize(before + count);
  }
  if (std::ferror(stream.get()))
    throw Error("{}: cannot be read: {}", file.string(), std::strerror(errno));
  return bytes;
}

std::string ReadBytes(const std::filesystem::path& file, size_t max_bytes) {
  std::string bytes = ReadHead(file, max_bytes + 1);
  if (bytes.size() > max_bytes) {
    throw Error("{}: is too large: expected at most {} bytes", file.string(), max_bytes);
  }
  return bytes;
}

std::string OneLine(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char code) { return code < 0x20 || code == 0x7f; },
      '?');
  return line;
}

std::string Quoted(std::string_view text) {
  return fmt::format("'{}{}'", OneLine(text.substr(0, kMaxQuotedLength)),
                     text.size() > kMaxQuotedLength ? "..." : "");
}

TextFile::TextFile(const std::filesystem::path& file)
    : name_(file.string()), bytes_(ReadBytes(file, kMaxTextBytes)) {
  std::string_view rest = bytes_;
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  for (int number = 1; !rest.empty(); ++number) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view text = Trim(rest.substr(0, end));
    if (!text.empty() && text.front() != '#') lines_.push_back({number, text});
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

std::string TextFile::Where(const TextLine& line) const {
  return fmt::format("{}:{}", name_, line.number);
}

void SplitAtBlanks(std::string_view text, std::vector<std::string_view>* fields) {
  fields->clear();
  for (size_t start = text.find_first_not_of(kBlanks); start != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(kBlanks, start), text.size());
    fields->push_back(text.substr(start, end - start));
    start = text.find_first_not_of(kBlanks, end);
  }
}

void SplitAtCommas(std::string_view text, std::vector<std::string_view>* fields) {
  fields->clear();
  for (size_t start = 0; start <= text.size();) {
    const size_t end = std::min(text.find(',', start), text.size());
    fields->push_back(Trim(text.substr(start, end - start)));
    start = end + 1;
  }
}

bool IsNumber(std::string_view text, double* number) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, *number);
  return status == std::errc() && stop == end && std::isfinite(*number);
}

bool HasDecimalComma(std::string_view text) {
  std::string with_point(text);
  const size_t comma = with_point.find(',');
  if (comma == std::string::npos || comma + 1 == with_point.size()) return false;
  with_point[comma] = '.';
  double number = 0;
  return IsNumber(with_point, &number);
}

double ParseFinite(std::string_view text, const std::string& where, std::string_view field) {
  double number = 0;
  if (!IsNumber(text, &number)) {
    throw Error("{}: {} is {}: expected a finite number{}", where, field, Quoted(text),
                PointHint(text));
  }
  return number;
}

Timestamp ParseSeconds(std::string_view text, const std::string& where) {
  const std::optional<int64_t> nanoseconds = ParseScaled(text, 9);
  if (!nanoseconds) {
    throw Error("{}: time is {}: expected decimal seconds of at most 9223372036{}", where,
                Quoted(text), PointHint(text));
  }
  return {*nanoseconds};
}

Timestamp ParseNanoseconds(std::string_view text, const std::string& where) {
  const std::optional<int64_t> nanoseconds = ParseScaled(text, 0);
  if (!nanoseconds) throw Error("{}: time is {}: expected nanoseconds", where, Quoted(text));
  return {*nanoseconds};
}

}  // namespace deepuav
