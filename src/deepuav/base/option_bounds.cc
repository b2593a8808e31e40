#include "deepuav/base/option_bounds.h"

#include <fmt/format.h>

#include <algorithm>

namespace deepuav {

bool NumberBounds::Hold(double value) const {
  if (or_zero && value == 0) return true;
  return (low_is_in ? value >= low : value > low) && (high_is_in ? value <= high : value < high);
}

std::string NumberBounds::Text() const {
  const std::string zero = or_zero ? "0, or " : "";
  if (low_is_in) return fmt::format("{}{} to {}{}", zero, low, high_is_in ? "" : "below ", high);
  return fmt::format("{}more than {}, {} {}", zero, low, high_is_in ? "at most" : "below", high);
}

bool TextBounds::Hold(const std::string& value) const {
  if (value.empty()) return may_be_empty;
  return words.empty() || std::find(words.begin(), words.end(), value) != words.end();
}

std::string TextBounds::Text() const {
  if (words.empty()) return expected;
  std::string text = words.front();
  for (size_t i = 1; i < words.size(); ++i)
    text += (i + 1 < words.size() ? ", " : " or ") + words[i];
  return text;
}

TextBounds TextBounds::OrEmpty() const {
  TextBounds bounds = *this;
  bounds.may_be_empty = true;
  return bounds;
}

TextBounds AnyText() { return {}; }

TextBounds OneOf(std::vector<std::string> words) {
  return {.words = std::move(words), .may_be_empty = false, .expected = ""};
}

TextBounds NotEmpty(std::string expected) {
  return {.words = {}, .may_be_empty = false, .expected = std::move(expected)};
}

}  // namespace deepuav
