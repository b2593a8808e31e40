#pragma once

#include <span>
#include <string>

namespace deepuav {

/// The candidate with the smallest edit distance (Levenshtein) to `name`, the first of equals: for
/// messages about unknown names. Empty where there is no candidate.
std::string NearestName(const std::string& name, std::span<const std::string> candidates);

}  // namespace deepuav
