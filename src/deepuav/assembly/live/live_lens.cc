#include "deepuav/assembly/live/live_lens.h"

#include <fmt/format.h>

#include <atomic>
#include <exception>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <vector>

#include "deepuav/base/logging.h"
#include "deepuav/base/time.h"
#include "deepuav/geometry/camera_scale.h"
#include "deepuav/io/datasets/dataset.h"

namespace deepuav {
namespace {

/// Images that were kept.
class KeptImages : public ImageSource {
 public:
  void Keep(GreyImage image, Timestamp time) {
    images_.push_back({.id = FrameId{size()}, .time = time, .image = std::move(image)});
  }
  int size() const { return static_cast<int>(images_.size()); }
  std::optional<Timestamp> last_time() const {
    return images_.empty() ? std::nullopt : std::optional(images_.back().time);
  }

  std::optional<TimedImage> Next() override {
    if (next_ >= images_.size()) return std::nullopt;
    return std::move(images_[next_++]);
  }
  std::optional<Timestamp> UpcomingTime(int ahead) const override {
    const size_t index = next_ + static_cast<size_t>(ahead);
    return index < images_.size() ? std::optional(images_[index].time) : std::nullopt;
  }
  void Skip() override { ++next_; }

 private:
  std::vector<TimedImage> images_;
  size_t next_ = 0;
};

/// The survey beside the source, which is read on, so that it is where the world is when the run
/// begins.
class LensSearch {
 public:
  LensSearch(const GuessedLens& working, const RunOptions& options, std::function<bool()> stop)
      : working_(working), options_(options), stop_(std::move(stop)) {}
  ~LensSearch() {
    is_given_up_ = true;
    if (thread_.joinable()) thread_.join();
  }
  LensSearch(const LensSearch&) = delete;
  LensSearch& operator=(const LensSearch&) = delete;

  bool has_begun() const { return thread_.joinable(); }
  bool has_ended() const { return has_ended_; }

  void Begin(KeptImages images) {
    images_ = std::move(images);
    thread_ = std::thread([this] {
      try {
        found_ = CalibrateFromImages(working_.camera, working_.focal_sigma, options_, &images_,
                                     [this] { return is_given_up_ || (stop_ && stop_()); });
      } catch (const std::exception& error) {
        Log().warn("the lens could not be looked for: {}", error.what());
      }
      has_ended_ = true;
    });
  }
  /// Once it has ended.
  std::optional<SampleCalibration> Take() {
    thread_.join();
    return std::move(found_);
  }

 private:
  const GuessedLens working_;
  const RunOptions& options_;
  const std::function<bool()> stop_;
  KeptImages images_;
  std::optional<SampleCalibration> found_;
  std::atomic<bool> is_given_up_{false}, has_ended_{false};
  std::thread thread_;
};

GuessedLens AtWorkingSize(const GuessedLens& guess, double working_pixels) {
  const cv::Size size = WorkingSize({guess.camera.width, guess.camera.height}, working_pixels);
  return {ScaledCamera(guess.camera, size.width, size.height), guess.focal_sigma};
}

/// Keeps images while the picture moves until there are enough, then searches.
class LensLearning {
 public:
  LensLearning(const GuessedLens& guess, const RunOptions& run, const LiveLensOptions& options,
               const LensHooks& hooks)
      : working_(AtWorkingSize(guess, run.images.working_pixels)),
        options_(options),
        hooks_(hooks),
        search_(working_, run, hooks.stop) {}

  void Keep(const GreyImage& image, Timestamp time, PictureState picture) {
    if (search_.has_begun() || !IsDue(time) || picture != PictureState::kMoving) return;
    GreyImage small;
    cv::resize(image, small, cv::Size(working_.camera.width, working_.camera.height), 0, 0,
               cv::INTER_AREA);
    kept_.Keep(std::move(small), time);
  }
  /// Also begins the search when its time has come.
  bool IsOver() {
    if ((hooks_.stop && hooks_.stop()) || search_.has_ended()) return true;
    if (search_.has_begun()) return false;
    const bool is_late = watching_.Seconds() >= options_.longest_s;
    if (kept_.size() < options_.images && !is_late) return false;
    if (kept_.size() < options_.fewest_images) return true;
    hooks_.say(
        fmt::format("the lens is looked for in {} images; tracking begins then", kept_.size()));
    search_.Begin(std::move(kept_));
    return false;
  }
  std::optional<SampleCalibration> Take() {
    if (search_.has_ended()) return search_.Take();
    const bool is_stopped = hooks_.stop && hooks_.stop();
    if (!search_.has_begun() && !is_stopped) {
      hooks_.say(
          fmt::format("{} images that moved in {:.0f} s, at least {} tell a lens: it is guessed",
                      kept_.size(), options_.longest_s, options_.fewest_images));
    }
    return std::nullopt;
  }

 private:
  bool IsDue(Timestamp time) const {
    const std::optional<Timestamp> last = kept_.last_time();
    return !last || SecondsBetween(*last, time) >= options_.interval_s;
  }

  const GuessedLens working_;
  const LiveLensOptions options_;
  const LensHooks& hooks_;
  const Stopwatch watching_;
  KeptImages kept_;
  LensSearch search_;
};

}  // namespace

std::optional<SampleCalibration> LearnLens(LiveSource* source, const GuessedLens& guess,
                                           const LiveFeedOptions& feed_options,
                                           const RunOptions& run, const LiveLensOptions& options,
                                           const LensHooks& hooks) {
  LensLearning learning(guess, run, options, hooks);
  const LiveFeed* looked_at = nullptr;
  LiveFeed feed(source, {guess.camera.width, guess.camera.height}, feed_options,
                {[&](const GreyImage& image, Timestamp time, const Stopwatch&) {
                   learning.Keep(image, time, looked_at->counts().picture);
                 },
                 hooks.say});
  looked_at = &feed;
  feed.Run([&] { return learning.IsOver(); });
  return learning.Take();
}

}  // namespace deepuav
