#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "deepuav/base/option_check.h"

namespace deepuav {

/// Looks among what options structs visit for the bounds of the number called `wanted`.
class BoundsFinder {
 public:
  BoundsFinder(std::string wanted, std::optional<NumberBounds>* found, std::string prefix = "")
      : wanted_(std::move(wanted)), found_(found), prefix_(std::move(prefix)) {}

  template <typename Value, typename... Bounds>
  void operator()(const std::string& name, Value&, const std::string&, const std::string&,
                  const Bounds&... bounds) const {
    if (JoinOptionName(prefix_, name) == wanted_) (Keep(bounds), ...);
  }
  template <typename Options>
  void Part(const std::string& name, Options& part) const {
    part.Visit(BoundsFinder(wanted_, found_, JoinOptionName(prefix_, name)));
  }

 private:
  void Keep(const NumberBounds& bounds) const { *found_ = bounds; }
  void Keep(const TextBounds&) const {}

  std::string wanted_;
  std::optional<NumberBounds>* found_;
  std::string prefix_;
};

/// A number within `bounds`.
CLI::Validator WithinBounds(const NumberBounds& bounds);

/// A number within the bounds of the option `name` of `Options`, so that what is beyond them is
/// told of the argument that the user knows. Throws std::bad_optional_access where there is none.
template <typename Options>
CLI::Validator WithinBoundsOf(const std::string& name) {
  std::optional<NumberBounds> bounds;
  Options().Visit(BoundsFinder(name, &bounds));
  return WithinBounds(bounds.value());
}

}  // namespace deepuav
