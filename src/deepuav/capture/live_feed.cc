#include "deepuav/capture/live_feed.h"

#include <fmt/format.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/base/wait.h"

namespace deepuav {

LiveFeed::LiveFeed(LiveSource* source, const cv::Size& calibrated, const LiveFeedOptions& options,
                   LiveSinks sinks)
    : source_(source),
      options_(options),
      sinks_(std::move(sinks)),
      clock_(options.clock),
      judge_(options.picture),
      fitter_(calibrated) {}

template <typename Change>
void LiveFeed::Count(Change change) {
  const std::scoped_lock lock(mutex_);
  change(&counts_);
}

LiveCounts LiveFeed::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

bool LiveFeed::OpenFirst(const std::function<bool()>& stop) {
  try {
    source_->Open();
  } catch (const Error&) {
    if (!options_.was_open) throw;
    return Reopen(stop);
  }
  since_open_.Restart();
  Count([](LiveCounts* counts) { counts->is_open = true; });
  return true;
}

void LiveFeed::Run(const std::function<bool()>& stop) {
  if (!OpenFirst(stop)) return;
  while (!stop()) {
    if (const std::optional<LiveImage> image = source_->Next(stop)) {
      Count([this](LiveCounts* counts) { counts->late = source_->late(); });
      Take(*image);
      continue;
    }
    if (source_->EndsForGood() || stop() || !Reopen(stop)) break;
  }
  Count([](LiveCounts* counts) { counts->is_open = false; });
}

bool LiveFeed::Reopen(const std::function<bool()>& stop) {
  Count([](LiveCounts* counts) { counts->is_open = false; });
  sinks_.say("the link dropped: opening it again");
  const Stopwatch gone;
  if (since_open_.Seconds() >= options_.held_s) wait_s_ = 0;
  while (!stop()) {
    WaitUnless(stop, wait_s_);
    if (stop()) return false;
    wait_s_ = std::clamp(2 * wait_s_, options_.first_wait_s, options_.longest_wait_s);
    try {
      source_->Open();
    } catch (const Error&) {
      continue;
    }
    since_open_.Restart();
    clock_.Reopened();
    sinks_.say(fmt::format("the link is open again after {:.1f} s", gone.Seconds()));
    Count([](LiveCounts* counts) {
      counts->is_open = true;
      ++counts->reconnects;
    });
    return true;
  }
  return false;
}

void LiveFeed::TellPicture(PictureState picture, Timestamp arrival) {
  if (picture == picture_) return;
  if (picture == PictureState::kFrozen) {
    sinks_.say("the picture is frozen: the same image again and again is left out");
  } else if (picture == PictureState::kStanding) {
    sinks_.say("the camera stands still");
  } else {
    sinks_.say(fmt::format("the picture moves again after {:.1f} s",
                           SecondsBetween(picture_since_, arrival)));
  }
  picture_ = picture;
  picture_since_ = arrival;
}

void LiveFeed::Take(const LiveImage& image) {
  const Stopwatch since_arrival;
  const Timestamp arrival = arrival_clock_.Now();
  const PictureState picture = judge_.Judge(image.image, arrival);
  TellPicture(picture, arrival);
  std::string change, jump;
  const std::optional<GreyImage> fitting = fitter_.Fit(image.image, &change);
  if (!change.empty()) sinks_.say(change);
  const bool is_frozen = picture == PictureState::kFrozen;
  Count([&](LiveCounts* counts) {
    ++counts->arrived;
    counts->picture = picture;
    counts->frozen += is_frozen;
    counts->misfits += !is_frozen && !fitting;
  });
  if (is_frozen || !fitting) return;
  const Timestamp time = clock_.TimeOf(image.stream_time, arrival, &jump);
  if (!jump.empty()) sinks_.say(jump);
  sinks_.image(*fitting, time, since_arrival);
}

}  // namespace deepuav
