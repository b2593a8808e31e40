#include "deepuav/base/nearest_name.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace deepuav {
namespace {

size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string NearestName(const std::string& name, std::span<const std::string> candidates) {
  // A longer name is a mistake of another kind, and the distance costs the product of the lengths.
  constexpr size_t kMaxLength = 200;
  const std::string start = name.substr(0, kMaxLength);
  const auto nearest = std::min_element(candidates.begin(), candidates.end(),
                                        [&](const std::string& a, const std::string& b) {
                                          return EditDistance(a, start) < EditDistance(b, start);
                                        });
  return nearest == candidates.end() ? std::string() : *nearest;
}

}  // namespace deepuav
