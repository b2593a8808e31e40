#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "deepuav/viewer/view_state.h"

namespace deepuav {

/// One message of the page, of which many clients may be sent the same bytes.
struct ViewMessage {
  std::shared_ptr<const std::string> bytes;
  bool is_text = false;
};

/// Where a client has got to.
struct ViewCursor {
  std::array<uint64_t, 3> seen = {};
  uint64_t events = 0;
  size_t turn = 0;  ///< The topic that comes first: they take turns, so that none starves.
};

/// What the page shows, always the newest of it: nothing queues up, whoever is slow misses what
/// lies between. Thread-safe; nobody who tells it something waits for more than a copy.
class ViewModel {
 public:
  /// `title` says what is watched.
  explicit ViewModel(std::string title) : title_(std::move(title)) {}

  void SetFrame(FrameView frame);
  void SetMap(MapView map);
  /// Loops closed and maps merged so far.
  void CountChanges(int closed_loops, int merged_maps);
  /// Of a run that is over, in place of this program's own: the most it took; 0: not known.
  void SetPeakMemory(double peak_mb);
  void AddStage(const std::string& stage, double seconds);
  /// A line on what happened.
  void AddEvent(const std::string& line);
  /// Asked now and then, in the server's thread.
  void AskForFeed(std::function<FeedView()> feed);

  /// Whether anyone looks: only then pictures are worth a copy.
  bool IsWatched() const { return watchers_ > 0; }
  void CountWatchers(int change) { watchers_ += change; }

  /// Makes messages of what is new; called by the server's thread alone. At the end nothing waits
  /// until it is due.
  void Refresh(bool is_end = false);
  /// A message that the client has not got; nothing where it has all.
  std::optional<ViewMessage> Next(ViewCursor* cursor) const;

 private:
  enum Topic { kStatus, kPicture, kMap };
  static constexpr size_t kTopics = 3;

  void Publish(Topic topic, std::string bytes);
  std::string StatusJson(const FeedView& feed) const;
  double FramesPerSecond() const;

  const std::string title_;
  std::atomic<int> watchers_{0};
  mutable std::mutex mutex_;
  FrameView frame_;
  std::optional<MapView> new_map_;
  int64_t map_ = -1;
  int keyframes_ = 0, landmarks_ = 0, closed_loops_ = 0, merged_maps_ = 0;
  std::optional<double> peak_mb_;
  std::map<std::string, double> stage_s_;  ///< Means of the latest calls.
  std::deque<Stopwatch> since_frames_;     ///< Of the latest seconds.
  uint64_t frames_ = 0, pictured_ = 0;
  std::deque<std::string> events_;
  uint64_t events_so_far_ = 0;
  std::function<FeedView()> feed_;
  Stopwatch since_status_, since_picture_;
  struct Published {
    uint64_t version = 0;
    std::shared_ptr<const std::string> bytes;
  };
  std::array<Published, kTopics> published_;
};

}  // namespace deepuav
