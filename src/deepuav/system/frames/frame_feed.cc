#include "deepuav/system/frames/frame_feed.h"

#include <memory>
#include <utility>

#include "deepuav/map/frame_motion.h"

namespace deepuav {
namespace {

/// A patch is found at up to 2^(kPyramidLevels - 1) times the size of its reference, and half more.
constexpr int kPyramidLevels = 3;

/// Null of an image that was not given.
std::shared_ptr<const ImagePyramid> MakePyramid(const GreyImage& image) {
  return image.empty() ? nullptr : std::make_shared<const ImagePyramid>(image, kPyramidLevels);
}

}  // namespace

SequentialFeed::SequentialFeed(ImageSource* images, Extractor* extractor, StageClock* clock,
                               const CameraTurns* turns)
    : images_(images), extractor_(extractor), clock_(clock), turns_(turns) {}

std::optional<Frame> SequentialFeed::Next() {
  const std::optional<TimedImage> image = images_->Next();
  if (!image) return std::nullopt;
  clock_->Add("decode", image->decode_s);
  ExtractionTimes times;
  Frame frame{image->id, image->time,
              std::make_shared<const Features>(extractor_->Extract(image->image, &times)),
              MakePyramid(image->image)};
  clock_->Add("network", times.network_s);
  clock_->Add("key points", times.postprocessing_s);
  CorrectForTurn(image->turn_in_readout, &frame);
  frame.turn_sigma_rad = image->turn_sigma_rad;
  frame.turn_since_before = TurnTo(*image);
  return frame;
}

std::optional<Eigen::Quaterniond> SequentialFeed::TurnTo(const TimedImage& image) {
  const std::optional<Timestamp> before = std::exchange(last_time_, image.time);
  if (image.turn_since_before || !turns_ || !before) return image.turn_since_before;
  return turns_->Between(*before, image.time);
}

void SequentialFeed::CorrectForTurn(std::optional<ReadoutMotion> turn, Frame* frame) const {
  if (!turns_) return;
  if (!turn) turn = turns_->DuringReadout(frame->time);
  if (!turn) return;
  *frame = WithMotion(*frame, *turn, turns_->camera());
  frame->turn_is_measured = true;
}

PrefetchingFeed::PrefetchingFeed(FrameFeed* feed, int frames_ahead)
    : feed_(feed), queue_(static_cast<size_t>(frames_ahead)), thread_([this] { Work(); }) {}

PrefetchingFeed::~PrefetchingFeed() {
  queue_.Close();
  thread_.join();
}

void PrefetchingFeed::Work() {
  try {
    while (std::optional<Frame> frame = feed_->Next()) {
      if (!queue_.Push(std::move(*frame))) break;
    }
  } catch (...) {
    failure_ = std::current_exception();
  }
  queue_.Close();
}

std::optional<Frame> PrefetchingFeed::Next() {
  std::optional<Frame> frame = queue_.Pop();
  if (!frame && failure_) std::rethrow_exception(failure_);
  return frame;
}

}  // namespace deepuav
