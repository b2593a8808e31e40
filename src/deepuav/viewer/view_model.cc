#include "deepuav/viewer/view_model.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "deepuav/viewer/view_messages.h"

namespace deepuav {
namespace {

constexpr double kStatusInterval = 0.05, kPictureInterval = 0.1;  // Seconds, at least.
constexpr double kIdleStatusInterval = 0.5;                       // Where no frame comes.
constexpr double kRateWindow = 2;
constexpr size_t kMostEvents = 100;

double ResidentMb() {
  std::ifstream file("/proc/self/statm");
  double all_pages = 0, resident_pages = 0;
  file >> all_pages >> resident_pages;
  return resident_pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024 * 1024);
}

std::string Text(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void ViewModel::SetFrame(FrameView frame) {
  const std::scoped_lock lock(mutex_);
  frame_ = std::move(frame);
  ++frames_;
  since_frames_.emplace_back();
  while (since_frames_.front().Seconds() > kRateWindow) since_frames_.pop_front();
}

void ViewModel::SetMap(MapView map) {
  const std::scoped_lock lock(mutex_);
  map_ = map.map;
  keyframes_ = map.keyframes;
  landmarks_ = map.landmarks;
  new_map_ = std::move(map);
}

void ViewModel::CountChanges(int closed_loops, int merged_maps) {
  const std::scoped_lock lock(mutex_);
  closed_loops_ = closed_loops;
  merged_maps_ = merged_maps;
}

void ViewModel::SetPeakMemory(double peak_mb) {
  const std::scoped_lock lock(mutex_);
  peak_mb_ = peak_mb;
}

void ViewModel::AddStage(const std::string& stage, double seconds) {
  constexpr double kNewest = 0.1;  // Its share in the mean.
  const std::scoped_lock lock(mutex_);
  const auto [entry, is_first] = stage_s_.emplace(stage, seconds);
  if (!is_first) entry->second += kNewest * (seconds - entry->second);
}

void ViewModel::AddEvent(const std::string& line) {
  const std::scoped_lock lock(mutex_);
  events_.push_back(line);
  ++events_so_far_;
  if (events_.size() > kMostEvents) events_.pop_front();
}

void ViewModel::AskForFeed(std::function<FeedView()> feed) {
  const std::scoped_lock lock(mutex_);
  feed_ = std::move(feed);
}

double ViewModel::FramesPerSecond() const {
  const auto recent =
      std::count_if(since_frames_.begin(), since_frames_.end(),
                    [](const Stopwatch& since) { return since.Seconds() <= kRateWindow; });
  if (recent < 2) return 0;
  const Stopwatch& first = since_frames_[since_frames_.size() - static_cast<size_t>(recent)];
  return static_cast<double>(recent - 1) /
         std::max(first.Seconds() - since_frames_.back().Seconds(), 1e-3);
}

std::string ViewModel::StatusJson(const FeedView& feed) const {
  nlohmann::json stages = nlohmann::json::object();
  for (const auto& [stage, seconds] : stage_s_) stages[stage] = 1e3 * seconds;
  nlohmann::json json = {{"kind", "status"},
                         {"title", title_},
                         {"frame", frame_.id.value},
                         {"time_s", frame_.time.seconds()},
                         {"state", frame_.state},
                         {"reason", frame_.reason},
                         {"map", frame_.map},
                         {"map_shown", map_},
                         {"pose", nullptr},
                         {"key_points", frame_.key_points},
                         {"landmarks", frame_.landmarks},
                         {"frames_per_s", FramesPerSecond()},
                         {"memory_mb", peak_mb_ ? *peak_mb_ : ResidentMb()},
                         {"memory_is_peak", peak_mb_.has_value()},
                         {"keyframes", keyframes_},
                         {"points", landmarks_},
                         {"closed_loops", closed_loops_},
                         {"merged_maps", merged_maps_},
                         {"stages_ms", stages},
                         {"link", feed.link},
                         {"arrived", feed.arrived},
                         {"skipped", feed.skipped},
                         {"reconnects", feed.reconnects},
                         {"latency_ms", feed.latency_ms},
                         {"latency_p95_ms", feed.latency_p95_ms}};
  if (frame_.world_from_cam) json["pose"] = PoseJson(*frame_.world_from_cam);
  return Text(json);
}

void ViewModel::Publish(Topic topic, std::string bytes) {
  Published& published = published_[topic];
  ++published.version;
  published.bytes = std::make_shared<const std::string>(std::move(bytes));
}

void ViewModel::Refresh(bool is_end) {
  if (!IsWatched()) return;
  std::unique_lock lock(mutex_);
  const bool is_new = frames_ != pictured_;
  if (is_end || since_status_.Seconds() >= (is_new ? kStatusInterval : kIdleStatusInterval)) {
    since_status_.Restart();
    const auto ask = feed_;
    lock.unlock();
    const FeedView feed = ask ? ask() : FeedView{};
    lock.lock();
    Publish(kStatus, StatusJson(feed));
  }
  std::optional<MapView> map = std::exchange(new_map_, std::nullopt);
  std::optional<FrameView> pictured;
  if (is_new && !frame_.image.empty() && (is_end || since_picture_.Seconds() >= kPictureInterval)) {
    since_picture_.Restart();
    pictured_ = frames_;
    pictured = frame_;
  }
  lock.unlock();
  // Packed and compressed while others may tell more.
  std::string map_bytes, picture_bytes;
  if (map) map_bytes = MapMessage(*map);
  if (pictured) picture_bytes = PictureMessage(*pictured);
  lock.lock();
  if (map) Publish(kMap, std::move(map_bytes));
  if (pictured) Publish(kPicture, std::move(picture_bytes));
}

std::optional<ViewMessage> ViewModel::Next(ViewCursor* cursor) const {
  const std::scoped_lock lock(mutex_);
  if (cursor->events < events_so_far_) {
    const size_t unseen =
        std::min(static_cast<size_t>(events_so_far_ - cursor->events), events_.size());
    const std::vector<std::string> lines(events_.end() - static_cast<std::ptrdiff_t>(unseen),
                                         events_.end());
    cursor->events = events_so_far_;
    return ViewMessage{
        std::make_shared<const std::string>(Text({{"kind", "events"}, {"lines", lines}})), true};
  }
  for (size_t i = 0; i < kTopics; ++i) {
    const size_t topic = (cursor->turn + i) % kTopics;
    const Published& published = published_[topic];
    if (!published.bytes || published.version == cursor->seen[topic]) continue;
    cursor->seen[topic] = published.version;
    cursor->turn = topic + 1;
    return ViewMessage{published.bytes, topic == kStatus};
  }
  return std::nullopt;
}

}  // namespace deepuav
