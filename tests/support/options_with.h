#pragma once

#include <type_traits>

namespace deepuav {

/// Default options but for one member.
template <typename Options, typename T>
Options OptionsWith(T Options::*member, std::type_identity_t<T> value) {
  Options options;
  options.*member = value;
  return options;
}

}  // namespace deepuav
