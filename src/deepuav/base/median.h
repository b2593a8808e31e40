#pragma once

#include <algorithm>
#include <cassert>
#include <iterator>
#include <vector>

namespace deepuav {

/// The value in the middle; of an even number the larger of both. Of at least one value.
template <typename Value>
Value Median(std::vector<Value> values) {
  assert(!values.empty());
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace deepuav
