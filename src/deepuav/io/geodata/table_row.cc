#include "deepuav/io/geodata/table_row.h"

#include <algorithm>
#include <cctype>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr size_t kMostHeadLines = 10;
constexpr char kQuote = '"';

bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

bool IsBetweenDigits(std::string_view line, size_t i) {
  return i > 0 && i + 1 < line.size() && IsDigit(line[i - 1]) && IsDigit(line[i + 1]);
}

char SeparatorOf(std::string_view line) {
  const bool quotes_pair = std::ranges::count(line, kQuote) % 2 == 0;
  bool is_quoted = false, has_tabs = false, separates = false;
  for (size_t i = 0; i < line.size(); ++i) {
    if (line[i] == kQuote) is_quoted = quotes_pair && !is_quoted;
    if (is_quoted) continue;
    if (line[i] == ';') return ';';
    has_tabs |= line[i] == '\t';
    if (line[i] != ',') continue;
    separates |= !IsBetweenDigits(line, i);
  }
  return has_tabs && !separates ? '\t' : ',';
}

/// Where a quoted text that begins behind `start` ends: at a quote with nothing but blanks before
/// the separator. The position of that quote, or npos.
size_t ClosingQuote(std::string_view line, size_t start, char separator) {
  const std::string_view blanks = separator == '\t' ? " " : " \t";
  for (size_t at = line.find(kQuote, start); at != std::string_view::npos;
       at = line.find(kQuote, at + 1)) {
    if (at + 1 < line.size() && line[at + 1] == kQuote) {  // a doubled one stands for itself
      ++at;
      continue;
    }
    const size_t next = line.find_first_not_of(blanks, at + 1);
    if (next == std::string_view::npos || line[next] == separator) return at;
  }
  return std::string_view::npos;
}

std::string_view Without(std::string_view ends, std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(ends), text.size()));
  return text.substr(0, text.find_last_not_of(ends) + 1);
}

}  // namespace

bool SplitRow(std::string_view line, TableRow* fields) {
  constexpr std::string_view kBlanks = " \t", kBlanksAndQuotes = " \t\"";
  const char separator = SeparatorOf(line);
  bool quotes_close = true;
  fields->clear();
  while (true) {
    const size_t first = line.find_first_not_of(kBlanks.substr(0, separator == '\t' ? 1 : 2));
    const bool opens = first != std::string_view::npos && line[first] == kQuote;
    const size_t closing =
        opens ? ClosingQuote(line, first + 1, separator) : std::string_view::npos;
    const size_t from = closing == std::string_view::npos ? 0 : closing;
    const size_t end = std::min(line.find(separator, from), line.size());
    const std::string_view text = Without(kBlanks, line.substr(0, end));
    quotes_close &= from > 0 || !(opens || text.ends_with(kQuote));
    fields->push_back(Without(kBlanksAndQuotes, text));
    if (end == line.size()) return quotes_close;
    line.remove_prefix(end + 1);
  }
}

void ReadRow(std::string_view line, TableRow* fields, const std::string& where) {
  if (SplitRow(line, fields)) return;
  throw Error("{}: a quote has no other end in {}: expected it about a whole field", where,
              Quoted(line));
}

void CheckFieldCount(const TableRow& fields, size_t needed, const char* names,
                     const std::string& where) {
  if (fields.size() >= needed) return;
  throw Error("{}: {} fields: expected at least {} ({})", where, fields.size(), needed, names);
}

std::vector<HeadLine> FirstLines(const std::filesystem::path& file) {
  constexpr size_t kHeadBytes = 8192;
  constexpr std::string_view kBlank = " \t\r\xEF\xBB\xBF";
  const std::string head = ReadHead(file, kHeadBytes);
  std::string_view rest = head;
  std::vector<HeadLine> lines;
  while (!rest.empty() && lines.size() < kMostHeadLines) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
    const bool is_comment = line.starts_with('#');
    if (is_comment) line.remove_prefix(std::min(line.find_first_not_of("# \t"), line.size()));
    line = line.substr(0, line.find_last_not_of(kBlank) + 1);
    if (!line.empty()) lines.push_back({std::string(line), is_comment});
  }
  return lines;
}

size_t FirstRow(const TextFile& text, const HeadLine& head) {
  if (head.is_comment) return 0;
  const size_t among = std::min(text.lines().size(), kMostHeadLines);
  for (size_t i = 0; i < among; ++i) {
    if (text.lines()[i].text == head.text) return i + 1;
  }
  return 0;
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return lower;
}

}  // namespace deepuav
