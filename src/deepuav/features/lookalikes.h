#pragma once

#include <vector>

#include "deepuav/features/features.h"

namespace deepuav {

/// For each key point how many others, farther than `apart_px` from it in the image as taken, have
/// descriptors of more than this cosine similarity to its own.
std::vector<int> CountLookalikes(const Features& features, double similarity, double apart_px);

/// The share of the key points that have lookalikes; 0 of none.
double ShareWithLookalikes(const std::vector<int>& lookalikes);

/// The `count` best of the key points, which are by falling score, with the fewest lookalikes, in
/// the same order: what occurs once in an image can be matched, what occurs at many places of it
/// matches at any of these.
Features MostDistinct(const Features& features, const std::vector<int>& lookalikes, int count);

}  // namespace deepuav
