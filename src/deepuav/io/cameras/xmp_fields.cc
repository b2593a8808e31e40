#include "deepuav/io/cameras/xmp_fields.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

namespace deepuav {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
/// No value that is asked for has more.
constexpr size_t kMostBytes = 1000;

std::string_view WithoutBlanksBefore(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return text;
}

/// What follows the field's name where it stands as a whole, and is not that of an end tag.
std::string_view AfterName(std::string_view head, std::string_view name) {
  constexpr std::string_view kAfter = "=> \t\r\n";
  for (size_t at = head.find(name); at != std::string_view::npos; at = head.find(name, at + 1)) {
    const bool is_end_tag = at > 0 && head[at - 1] == '/';
    const std::string_view rest = head.substr(at + name.size());
    if (!is_end_tag && !rest.empty() && kAfter.find(rest.front()) != std::string_view::npos)
      return WithoutBlanksBefore(rest);
  }
  return {};
}

std::string_view Trimmed(std::string_view text) {
  text = WithoutBlanksBefore(text);
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

/// What stands in an element; of a list, up to the end of `name`, the texts of its items with
/// commas in between. Empty where it has no end.
std::string ElementText(std::string_view rest, std::string_view name) {
  rest = WithoutBlanksBefore(rest);
  if (!rest.starts_with('<')) {
    const size_t end = rest.find('<');
    return end == std::string_view::npos ? "" : std::string(Trimmed(rest.substr(0, end)));
  }
  std::string all;
  for (size_t tag = rest.find('<'); tag != std::string_view::npos; tag = rest.find('<')) {
    const std::string_view text = Trimmed(rest.substr(0, tag));
    if (!text.empty()) all.append(all.empty() ? "" : ",").append(text);
    rest.remove_prefix(tag + 1);
    if (rest.starts_with('/') && rest.substr(1).starts_with(name)) return all;
    if (const size_t end = rest.find('>'); end != std::string_view::npos)
      rest.remove_prefix(end + 1);
  }
  return {};
}

}  // namespace

std::string XmpText(std::string_view head, std::string_view name) {
  std::string_view rest = AfterName(head, name);
  if (rest.starts_with('>')) return ElementText(rest.substr(1, kMostBytes), name);
  if (!rest.starts_with('=')) return {};
  rest = WithoutBlanksBefore(rest.substr(1));
  if (!rest.starts_with('"') && !rest.starts_with('\'')) return {};
  const std::string_view value = rest.substr(1, kMostBytes);
  const size_t end = value.find(rest.front());
  return end == std::string_view::npos ? "" : std::string(Trimmed(value.substr(0, end)));
}

std::optional<double> XmpNumber(std::string_view head, std::string_view name) {
  const std::string value_text = XmpText(head, name);
  std::string_view text = value_text;
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace deepuav
