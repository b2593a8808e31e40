#include "deepuav/evaluation/measures/association.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "deepuav/base/error.h"
#include "deepuav/base/intervals.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr double kNanosecondsPerSecond = 1e9;

std::vector<int64_t> Nanoseconds(const Trajectory& trajectory, int64_t offset) {
  std::vector<int64_t> stamps;
  stamps.reserve(trajectory.size());
  for (const TimedPose& pose : trajectory) stamps.push_back(pose.time.nanoseconds + offset);
  return stamps;
}

int NearestIndex(const std::vector<int64_t>& stamps, int64_t stamp) {
  const auto after = std::upper_bound(stamps.begin(), stamps.end(), stamp);
  if (after == stamps.begin()) return 0;
  const auto before = after - 1;
  const bool take_after = after != stamps.end() && *after - stamp < stamp - *before;
  return static_cast<int>((take_after ? after : before) - stamps.begin());
}

struct Match {
  int few, many;
  int64_t difference;
};

void KeepNearestOfShared(std::vector<Match>& matches) {
  std::vector<Match> kept;
  for (const Match& match : matches) {
    if (kept.empty() || kept.back().many != match.many) {
      kept.push_back(match);
    } else if (match.difference < kept.back().difference) {
      kept.back() = match;
    }
  }
  matches = std::move(kept);
}

int64_t RoundedNanoseconds(double seconds) {
  return static_cast<int64_t>(std::llround(seconds * kNanosecondsPerSecond));
}

std::string RangeText(const Trajectory& trajectory, double offset_s) {
  if (trajectory.empty()) return "no poses";
  return fmt::format("{:.3f} to {:.3f} s", trajectory.front().time.seconds() + offset_s,
                     trajectory.back().time.seconds() + offset_s);
}

struct InterpolatedPoses {
  Trajectory at, interpolated;
};

/// The poses at the moments of others, to whose times `offset` is added, in nanoseconds.
InterpolatedPoses InterpolateAt(const Trajectory& moments, int64_t offset, const Trajectory& poses,
                                int64_t max_gap) {
  InterpolatedPoses result;
  size_t after = 0;
  for (const TimedPose& moment : moments) {
    const Timestamp time{moment.time.nanoseconds + offset};
    while (after < poses.size() && poses[after].time < time) ++after;
    if (after == poses.size()) break;
    if (poses[after].time == time) {
      result.interpolated.push_back(poses[after]);
    } else if (after > 0 &&
               poses[after].time.nanoseconds - poses[after - 1].time.nanoseconds <= max_gap) {
      result.interpolated.push_back(InterpolatePose(poses[after - 1], poses[after], time));
    } else {
      continue;
    }
    result.at.push_back(moment);
  }
  return result;
}

}  // namespace

void AssociationOptions::Check() const { CheckOptions("", *this); }

std::vector<AssociatedPair> Associate(const Trajectory& truth, const Trajectory& estimate,
                                      const AssociationOptions& options) {
  options.Check();
  const bool truth_is_shorter = truth.size() < estimate.size();
  const int64_t offset = RoundedNanoseconds(options.time_offset_s);
  const int64_t limit = RoundedNanoseconds(options.max_difference_s);
  const std::vector<int64_t> truth_stamps = Nanoseconds(truth, 0);
  const std::vector<int64_t> estimate_stamps = Nanoseconds(estimate, offset);
  const std::vector<int64_t>& few = truth_is_shorter ? truth_stamps : estimate_stamps;
  const std::vector<int64_t>& many = truth_is_shorter ? estimate_stamps : truth_stamps;

  std::vector<Match> matches;
  for (size_t i = 0; i < few.size(); ++i) {
    const int nearest = NearestIndex(many, few[i]);
    const int64_t difference = std::abs(many[static_cast<size_t>(nearest)] - few[i]);
    if (difference <= limit) matches.push_back({static_cast<int>(i), nearest, difference});
  }
  if (options.one_to_one) KeepNearestOfShared(matches);
  if (matches.empty()) {
    throw Error(
        "No pose of the estimate lies within {} s of a pose of the truth: the truth spans {}, the "
        "estimate {}{}",
        options.max_difference_s, RangeText(truth, 0), RangeText(estimate, options.time_offset_s),
        options.time_offset_s == 0 ? "" : " with the time offset");
  }

  std::vector<AssociatedPair> pairs;
  pairs.reserve(matches.size());
  for (const Match& match : matches) {
    pairs.push_back(truth_is_shorter ? AssociatedPair{match.few, match.many}
                                     : AssociatedPair{match.many, match.few});
  }
  return pairs;
}

InterpolatedPairs InterpolateDenser(const Trajectory& truth, const Trajectory& estimate,
                                    const AssociationOptions& options) {
  options.Check();
  const int64_t offset = RoundedNanoseconds(options.time_offset_s);
  const int64_t max_gap = RoundedNanoseconds(options.max_gap_s);
  InterpolatedPairs result;
  result.truth_is_interpolated = MedianInterval_s(estimate) > MedianInterval_s(truth);
  if (result.truth_is_interpolated) {
    InterpolatedPoses poses = InterpolateAt(estimate, offset, truth, max_gap);
    result.estimate = std::move(poses.at);
    result.truth = std::move(poses.interpolated);
  } else {
    InterpolatedPoses poses = InterpolateAt(truth, -offset, estimate, max_gap);
    result.truth = std::move(poses.at);
    result.estimate = std::move(poses.interpolated);
  }
  if (result.truth.empty()) {
    const bool of_truth = result.truth_is_interpolated;
    throw Error(
        "No moment of the {} lies between poses of the {} that are at most {} s apart: the truth "
        "spans {}, the estimate {}{}",
        of_truth ? "estimate" : "truth", of_truth ? "truth" : "estimate", options.max_gap_s,
        RangeText(truth, 0), RangeText(estimate, options.time_offset_s),
        options.time_offset_s == 0 ? "" : " with the time offset");
  }
  return result;
}

int CountSharedPoses(const std::vector<AssociatedPair>& pairs) {
  int shared = 0;
  for (size_t i = 1; i < pairs.size(); ++i) {
    shared += pairs[i].truth == pairs[i - 1].truth || pairs[i].estimate == pairs[i - 1].estimate;
  }
  return shared;
}

}  // namespace deepuav
