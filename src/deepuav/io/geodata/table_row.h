#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/io/files/text_file.h"

namespace deepuav {

using TableRow = std::vector<std::string_view>;

/// The fields of a line, without the quotes around them: separated by semicolons where it has any
/// outside of quotes, else by commas, else by tabs; by tabs, too, where every comma is a decimal
/// one. Says no where a quote has no other end; such a line is split as if it had no quotes.
bool SplitRow(std::string_view line, TableRow* fields);

/// The same of a row to be read. Throws Error where a quote has no other end.
void ReadRow(std::string_view line, TableRow* fields, const std::string& where);

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

}  // namespace deepuav
