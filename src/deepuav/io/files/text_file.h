#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/base/time.h"

namespace deepuav {

/// The bytes of a file. Throws Error naming the file when it cannot be read or holds more than
/// `max_bytes`.
std::string ReadBytes(const std::filesystem::path& file, size_t max_bytes);

/// The first `max_bytes` of a file, or all where it is shorter. Throws Error as ReadBytes does.
std::string ReadHead(const std::filesystem::path& file, size_t max_bytes);

/// `text` with its control characters replaced, for messages of one line.
std::string OneLine(std::string_view text);

/// OneLine in single quotes, cut where it is long.
std::string Quoted(std::string_view text);

struct TextLine {
  int number = 0;  ///< From 1.
  std::string_view text;
};

/// A text file by lines. Blank lines and lines that start with '#' are left out; carriage returns,
/// a byte order mark and blanks at either end of a line are removed.
class TextFile {
 public:
  /// Throws Error naming the file when it cannot be read or is larger than any such file can
  /// sensibly be.
  explicit TextFile(const std::filesystem::path& file);
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  const std::vector<TextLine>& lines() const { return lines_; }
  /// "file:line" for messages.
  std::string Where(const TextLine& line) const;

 private:
  std::string name_;
  std::string bytes_;
  std::vector<TextLine> lines_;
};

/// Splits at runs of blanks, into `fields` (cleared first, so that its memory serves every line).
void SplitAtBlanks(std::string_view text, std::vector<std::string_view>* fields);
/// Splits at commas and trims blanks around each field.
void SplitAtCommas(std::string_view text, std::vector<std::string_view>* fields);

/// Whether `text` as a whole is a finite decimal number, then in `number`.
bool IsNumber(std::string_view text, double* number);

/// Whether `text` is a number that is written with a decimal comma.
bool HasDecimalComma(std::string_view text);

/// A finite number. Throws Error: "where: field is 'text': expected a finite number".
double ParseFinite(std::string_view text, const std::string& where, std::string_view field);

/// A time given in decimal seconds or nanoseconds ("1403636584.763555584", "1.4e+09"), read exactly
/// without passing through floating point and rounded to the nanosecond. Throws Error naming
/// `where` and what is expected.
Timestamp ParseSeconds(std::string_view text, const std::string& where);
Timestamp ParseNanoseconds(std::string_view text, const std::string& where);

}  // namespace deepuav
