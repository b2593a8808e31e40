#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace deepuav {

/// An integer that names one thing of one kind. Ids are given in order of creation and never
/// reused, so ordered containers of them iterate in a reproducible order.
template <typename Tag>
struct Id {
  int64_t value = -1;

  bool valid() const { return value >= 0; }
  auto operator<=>(const Id&) const = default;
};

using FrameId = Id<struct FrameTag>;  ///< Index of the frame in the run.
using KeyframeId = Id<struct KeyframeTag>;
using LandmarkId = Id<struct LandmarkTag>;
using MapId = Id<struct MapTag>;

}  // namespace deepuav

template <typename Tag>
struct std::hash<deepuav::Id<Tag>> {
  size_t operator()(deepuav::Id<Tag> id) const noexcept { return std::hash<int64_t>()(id.value); }
};
