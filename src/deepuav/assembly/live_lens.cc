#include "deepuav/assembly/live_lens.h"

#include <fmt/format.h>

#include <atomic>
#include <exception>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <vector>

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
  LensSearch(const Camera& camera, double focal_sigma, const RunOptions& options,
             std::function<bool()> stop)
      : camera_(camera), focal_sigma_(focal_sigma), options_(options), stop_(std::move(stop)) {}
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
        found_ = CalibrateFromImages(camera_, focal_sigma_, options_, &images_,
                                     [this] { return is_given_up_ || (stop_ && stop_()); });
      } catch (...) {
        failure_ = std::current_exception();
      }
      has_ended_ = true;
    });
  }
  /// Once it has ended. Throws what it threw.
  std::optional<SampleCalibration> Take() {
    thread_.join();
    if (failure_) std::rethrow_exception(failure_);
    return std::move(found_);
  }

 private:
  const Camera camera_;
  const double focal_sigma_;
  const RunOptions& options_;
  const std::function<bool()> stop_;
  KeptImages images_;
  std::optional<SampleCalibration> found_;
  std::exception_ptr failure_;
  std::atomic<bool> is_given_up_{false}, has_ended_{false};
  std::thread thread_;
};

Camera WorkingCamera(const Camera& camera, double working_pixels) {
  const cv::Size size = WorkingSize({camera.width, camera.height}, working_pixels);
  return ScaledCamera(camera, size.width, size.height);
}

}  // namespace

std::optional<SampleCalibration> LearnLens(LiveSource* source, const Camera& guess,
                                           double focal_sigma, const LiveFeedOptions& feed_options,
                                           const RunOptions& run, const LiveLensOptions& options,
                                           const std::function<void(const std::string&)>& say,
                                           const std::function<bool()>& stop) {
  const Camera working = WorkingCamera(guess, run.images.working_pixels);
  LensSearch search(working, focal_sigma, run, stop);
  KeptImages kept;
  const Stopwatch watching;
  const LiveFeed* looked_at = nullptr;
  const auto keep = [&](const GreyImage& image, Timestamp time, const Stopwatch&) {
    const bool is_due =
        !kept.last_time() || SecondsBetween(*kept.last_time(), time) >= options.interval_s;
    if (search.has_begun() || !is_due || looked_at->counts().picture != PictureState::kMoving)
      return;
    GreyImage small;
    cv::resize(image, small, cv::Size(working.width, working.height), 0, 0, cv::INTER_AREA);
    kept.Keep(std::move(small), time);
  };
  const auto is_over = [&] {
    if ((stop && stop()) || search.has_ended()) return true;
    const bool is_late = watching.Seconds() >= options.longest_s;
    if (search.has_begun() || (kept.size() < options.images && !is_late)) return false;
    if (kept.size() < options.fewest_images) return true;
    say(fmt::format("the lens is looked for in {} images; tracking begins then", kept.size()));
    search.Begin(std::move(kept));
    return false;
  };
  LiveFeed feed(source, {guess.width, guess.height}, feed_options, {keep, say});
  looked_at = &feed;
  feed.Run(is_over);
  if (search.has_begun() && search.has_ended()) return search.Take();
  if (!search.has_begun())
    say("too little moves before the camera to tell its lens: it is guessed");
  return std::nullopt;
}

}  // namespace deepuav
