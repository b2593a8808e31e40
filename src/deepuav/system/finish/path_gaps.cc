#include "deepuav/system/finish/path_gaps.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace deepuav {
namespace {

bool SeesFew(const FrameRecord& record, const PathGapLimits& limits) {
  return !record.reckoned && record.landmark_count < limits.firm_landmarks;
}

/// Where the stretch beyond one end of a gap ends: behind the frames that see few.
class RimFinder {
 public:
  RimFinder(const Atlas& atlas, const std::vector<FrameRecord>& records,
            const PathGapLimits& limits)
      : atlas_(atlas), records_(records), limits_(limits) {}

  size_t Last(size_t from, int step) const {
    size_t at = from;
    while (SeesFew(records_[at], limits_)) {
      const std::optional<size_t> next = Next(at, step);
      if (!next ||
          std::abs(SecondsBetween(records_[from].time, records_[*next].time)) > limits_.max_rim_s)
        break;
      at = *next;
    }
    return at;
  }

  /// The neighbour, where it has a pose in the same map.
  std::optional<size_t> Next(size_t at, int step) const {
    if (step < 0 ? at == 0 : at + 1 == records_.size()) return std::nullopt;
    const size_t next = step < 0 ? at - 1 : at + 1;
    const bool in_map = records_[next].located() &&
                        atlas_.Current(records_[next].map) == atlas_.Current(records_[at].map);
    return in_map ? std::optional(next) : std::nullopt;
  }

 private:
  const Atlas& atlas_;
  const std::vector<FrameRecord>& records_;
  const PathGapLimits& limits_;
};

void MarkThoseThatHold(const std::vector<FrameRecord>& records, const PathGapLimits& limits,
                       PathStretch* stretch) {
  stretch->holds.assign(stretch->size(), 0);
  for (size_t i = 0; i < stretch->size(); ++i) {
    const FrameRecord& record = records[stretch->first + i];
    stretch->holds[i] = record.located() && !SeesFew(record, limits);
  }
  stretch->holds.front() = stretch->holds.back() = 1;
}

}  // namespace

std::vector<PathStretch> FindPathGaps(const Atlas& atlas, const std::vector<FrameRecord>& records,
                                      const PathGapLimits& limits) {
  const RimFinder rims(atlas, records, limits);
  std::vector<PathStretch> stretches;
  std::optional<size_t> before;
  for (size_t i = 0; i < records.size(); ++i) {
    if (!records[i].located()) continue;
    const bool is_gap = before && *before + 1 < i &&
                        atlas.Current(records[*before].map) == atlas.Current(records[i].map) &&
                        SecondsBetween(records[*before].time, records[i].time) <= limits.max_gap_s;
    if (is_gap) {
      const size_t first = rims.Last(*before, -1), last = rims.Last(i, +1);
      PathStretch stretch;
      stretch.first = rims.Next(first, -1).value_or(first);
      stretch.last = rims.Next(last, +1).value_or(last);
      if (!stretches.empty() && stretches.back().last >= stretch.first) {
        stretches.back().first = std::min(stretches.back().first, stretch.first);
        stretches.back().last = stretch.last;
      } else {
        stretches.push_back(stretch);
      }
    }
    before = i;
  }
  for (PathStretch& stretch : stretches) MarkThoseThatHold(records, limits, &stretch);
  return stretches;
}

}  // namespace deepuav
