#pragma once

#include <limits>
#include <string>
#include <vector>

namespace deepuav {

/// The numbers that an option may be.
struct NumberBounds {
  double low = 0;
  double high = 0;
  bool low_is_in = true;
  bool high_is_in = true;
  bool or_zero = false;  ///< 0 is in, too, where the others begin above it.

  bool Hold(double value) const;
  /// What is expected: "1 to 50".
  std::string Text() const;
};

/// From `low` to `high`, both allowed.
constexpr NumberBounds Between(double low, double high) { return {.low = low, .high = high}; }
/// More than `low`, at most `high`.
constexpr NumberBounds Above(double low, double high) {
  return {.low = low, .high = high, .low_is_in = false};
}
/// From `low` on, less than `high`.
constexpr NumberBounds Below(double low, double high) {
  return {.low = low, .high = high, .high_is_in = false};
}
/// More than `low`, less than `high`.
constexpr NumberBounds Within(double low, double high) {
  return {.low = low, .high = high, .low_is_in = false, .high_is_in = false};
}
constexpr NumberBounds ZeroOr(NumberBounds bounds) {
  bounds.or_zero = true;
  return bounds;
}
/// Of a seed of random numbers.
constexpr NumberBounds AnySeed() { return Between(0, std::numeric_limits<int>::max()); }

/// The texts that an option may be.
struct TextBounds {
  std::vector<std::string> words;  ///< One of these; none: any text.
  bool may_be_empty = true;
  std::string expected;  ///< What an empty text should be.

  bool Hold(const std::string& value) const;
  /// What is expected: "road or river"; empty where any text is allowed.
  std::string Text() const;
  TextBounds OrEmpty() const;
};

TextBounds AnyText();
TextBounds OneOf(std::vector<std::string> words);
/// `expected`: what the text is, as "the file of a network".
TextBounds NotEmpty(std::string expected);

}  // namespace deepuav
