#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/geometry/camera_scale.h"
#include "deepuav/io/camera_file.h"
#include "deepuav/io/found_camera.h"
#include "deepuav/io/layout_readers.h"
#include "deepuav/io/sensor_files.h"
#include "deepuav/io/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxRateHz = 10000;

/// The calibration that a file gives, if there is one.
struct VideoCalibration {
  std::optional<CameraFile> read;
  std::string file;  ///< For messages.
};

/// When each frame is shown, from the container, without decoding any; the first at 0. Empty where
/// it does not say, or what it says does not grow.
std::vector<Timestamp> ContainerTimes(const fs::path& file) {
  std::vector<int64_t> shown_ns;
  try {
    cv::VideoCapture packets;
    if (!packets.open(file.string(), cv::CAP_FFMPEG, {cv::CAP_PROP_FORMAT, -1})) return {};
    while (packets.grab())
      shown_ns.push_back(std::llround(packets.get(cv::CAP_PROP_POS_MSEC) * 1e6));
  } catch (const cv::Exception&) {
    return {};
  }
  std::sort(shown_ns.begin(), shown_ns.end());  // packets come in the order of decoding
  if (std::adjacent_find(shown_ns.begin(), shown_ns.end()) != shown_ns.end()) return {};
  std::vector<Timestamp> times;
  times.reserve(shown_ns.size());
  for (const int64_t shown : shown_ns) times.push_back({shown - shown_ns.front()});
  return times;
}

class VideoDataset : public Dataset {
 public:
  VideoDataset(const fs::path& file, const VideoCalibration& calibration,
               const DatasetOptions& options)
      : file_(file) {
    Open();  // Tells first what is no video: FFmpeg would wait for a pipe and follow a list.
    times_ = ContainerTimes(file);
    FindCamera(calibration);
    ReadRate(calibration);
    CountFrames();
    const cv::Size working =
        WorkingSize({stored_camera_.width, stored_camera_.height}, options.working_pixels);
    camera_ = ScaledCamera(stored_camera_, working.width, working.height);
  }

  std::string Kind() const override { return "video"; }
  const Camera& camera() const override { return camera_; }
  const Camera& stored_camera() const override { return stored_camera_; }
  int size() const override { return frame_count_; }
  Timestamp Time(int frame) const override {
    CheckFrame(frame);
    if (!times_.empty()) return times_[static_cast<size_t>(frame)];
    return {std::llround(frame * (1e9 / rate_hz_))};
  }
  std::string Name(int frame) const override {
    return fmt::format("{} frame {}", file_.string(), frame);
  }
  std::string ImageName(int frame) const override {
    return fmt::format("{}_{:06}.png", file_.stem().string(), frame);
  }
  GreyImage Load(int frame) override;
  cv::Mat3b LoadColor(int frame, const cv::Size& size) override;
  SensorStreams ReadSensors() const override { return ReadSensorsBesideVideo(file_); }
  CalibrationSource Calibration() const override { return source_; }

 private:
  void Open();
  void FindCamera(const VideoCalibration& calibration);
  void ReadRate(const VideoCalibration& calibration);
  void CountFrames();
  void Retrieve(int frame);
  void CheckFrame(int frame) const {
    if (frame < 0 || frame >= frame_count_)
      throw Error("frame {}: expected 0 to {}", frame, frame_count_ - 1);
  }

  fs::path file_;
  std::vector<Timestamp> times_;  ///< By frame; empty: by the rate.
  Camera stored_camera_, camera_;
  CalibrationSource source_;
  cv::VideoCapture capture_;
  int next_frame_ = 0;  ///< That grab() would yield.
  int frame_count_ = 0;
  double rate_hz_ = 0;
  cv::Mat decoded_;
};

/// FFmpeg, which goes by the content, would follow a list of files under a video's name to others.
bool LooksLikeVideo(std::string_view head) {
  constexpr std::string_view kMpegStarts[] = {{"\0\0\1", 3}, {"\0\0\0\1", 4}};
  constexpr std::string_view kAtoms[] = {"ftyp", "moov", "mdat", "free", "skip", "wide", "pnot"};
  constexpr size_t kAtomPlace = 4, kTransportPacket = 188, kTimedPacket = 192, kTimeBytes = 4;
  constexpr char kSync = 0x47;
  const auto at = [head](size_t place) { return place < head.size() ? head[place] : '\0'; };
  const auto starts = [](std::string_view text, const auto& known) {
    return std::any_of(std::begin(known), std::end(known),
                       [text](std::string_view start) { return text.starts_with(start); });
  };
  return head.starts_with("RIFF") || head.starts_with("\x1a\x45\xdf\xa3") ||
         starts(head, kMpegStarts) ||
         (head.size() > kAtomPlace && starts(head.substr(kAtomPlace), kAtoms)) ||
         (at(0) == kSync && at(kTransportPacket) == kSync) ||
         (at(kTimeBytes) == kSync && at(kTimeBytes + kTimedPacket) == kSync);
}

void VideoDataset::Open() {
  next_frame_ = 0;
  constexpr size_t kHeadBytes = 512;
  if (!LooksLikeVideo(ReadHead(file_, kHeadBytes))) {
    throw Error("{}: does not begin like a video: expected MP4, AVI, Matroska, WebM or MPEG",
                file_.string());
  }
  bool opened = false;
  // Named, as the others that OpenCV may hold guess at what a file could be and complain on stderr.
  for (const int backend : {cv::CAP_FFMPEG, cv::CAP_OPENCV_MJPEG}) {
    try {
      opened = opened || capture_.open(file_.string(), backend);
    } catch (const cv::Exception&) {  // as good as not opened
    }
  }
  if (!opened)
    throw Error("{}: cannot be opened as a video: expected a container that OpenCV reads",
                file_.string());
  // Calibrations are in the sensor's pixels, so the rotation in the container must not turn frames.
  capture_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
}

void VideoDataset::FindCamera(const VideoCalibration& calibration) {
  const cv::Size size(static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_WIDTH)),
                      static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_HEIGHT)));
  if (size.width <= 0 || size.height <= 0) {
    throw Error("{}: no picture can be decoded: the video is damaged or cut before its first one",
                file_.string());
  }
  if (!calibration.read || !calibration.read->has_intrinsics) {
    const FoundCamera guess = GuessedCamera(size);
    stored_camera_ = guess.camera;
    source_ = guess.source;
    Log().info("{}: no calibration: the focal length starts from a guess, {:.0f} px",
               file_.string(), guess.camera.pinhole.fx);
    return;
  }
  Camera camera = calibration.read->camera;
  // Made of frames that were turned as the container says.
  const auto degrees = static_cast<int>(capture_.get(cv::CAP_PROP_ORIENTATION_META));
  const bool is_sideways = degrees % 180 != 0;
  const bool is_of_turned = (camera.width > camera.height) != (size.width > size.height);
  if (is_sideways && is_of_turned) camera = TurnedCamera(camera, -degrees / 90);
  stored_camera_ = CameraForSize(camera, size, file_.string(), calibration.file);
  if (calibration.read->refine) source_ = CalibrationByHand();
}

void VideoDataset::ReadRate(const VideoCalibration& calibration) {
  const double container_hz = capture_.get(cv::CAP_PROP_FPS);
  const double given_hz = calibration.read ? calibration.read->camera.rate_hz : 0;
  rate_hz_ = std::isfinite(container_hz) && container_hz > 0 && container_hz < kMaxRateHz
                 ? container_hz
                 : given_hz;
  if (rate_hz_ <= 0) {
    throw Error("{}: gives no frame rate: expected one there or as rate_hz in {}", file_.string(),
                calibration.file.empty() ? "a camera.yaml beside it" : calibration.file);
  }
  stored_camera_.rate_hz = rate_hz_;
}

// Some containers do not say how many frames they hold: those are read through once.
void VideoDataset::CountFrames() {
  const double claimed = capture_.get(cv::CAP_PROP_FRAME_COUNT);
  if (!times_.empty()) {
    frame_count_ = static_cast<int>(times_.size());
  } else if (claimed >= 1 && claimed < std::numeric_limits<int>::max()) {
    frame_count_ = static_cast<int>(claimed);
  } else {
    while (capture_.grab()) ++frame_count_;
    Open();
  }
  if (frame_count_ == 0 || !capture_.grab()) {
    throw Error("{}: no frame can be decoded: the video is empty or damaged", file_.string());
  }
  Open();
}

/// Decodes the frame into decoded_.
void VideoDataset::Retrieve(int frame) {
  CheckFrame(frame);
  if (frame < next_frame_) Open();
  bool decoded = false;
  try {
    decoded = true;
    for (; decoded && next_frame_ <= frame; ++next_frame_) decoded = capture_.grab();
    decoded = decoded && capture_.retrieve(decoded_) && !decoded_.empty();
  } catch (const cv::Exception&) {
    decoded = false;
  }
  if (!decoded) throw Error("{}: cannot be decoded", Name(frame));
  if (decoded_.cols != stored_camera_.width || decoded_.rows != stored_camera_.height) {
    throw Error("{}: image is {}x{}: expected {}x{} as the first", Name(frame), decoded_.cols,
                decoded_.rows, stored_camera_.width, stored_camera_.height);
  }
}

cv::Mat3b VideoDataset::LoadColor(int frame, const cv::Size& size) {
  Retrieve(frame);
  cv::Mat color = decoded_.clone();
  if (color.channels() == 1) cv::cvtColor(decoded_, color, cv::COLOR_GRAY2BGR);
  if (color.size() != size) cv::resize(color, color, size, 0, 0, cv::INTER_AREA);
  return color;
}

GreyImage VideoDataset::Load(int frame) {
  Retrieve(frame);
  GreyImage grey;
  if (decoded_.channels() == 1) {
    grey = decoded_.clone();
  } else {
    cv::cvtColor(decoded_, grey, cv::COLOR_BGR2GRAY);
  }
  if (grey.cols == camera_.width && grey.rows == camera_.height) return grey;
  GreyImage reduced;
  cv::resize(grey, reduced, cv::Size(camera_.width, camera_.height), 0, 0, cv::INTER_AREA);
  return reduced;
}

/// Empty where there is none.
fs::path FindCameraFile(const fs::path& file, const DatasetOptions& options) {
  if (!options.camera_file.empty()) return options.camera_file;
  const fs::path same_stem = fs::path(file).replace_extension(".yaml");
  if (fs::exists(same_stem)) return same_stem;
  const fs::path in_folder = file.parent_path() / "camera.yaml";
  return fs::exists(in_folder) ? in_folder : fs::path();
}

}  // namespace

std::unique_ptr<Dataset> OpenVideo(const fs::path& file, const DatasetOptions& options) {
  const fs::path camera_file = FindCameraFile(file, options);
  VideoCalibration calibration;
  calibration.file = camera_file.string();
  if (!camera_file.empty()) calibration.read = ReadCameraFile(camera_file);
  return std::make_unique<VideoDataset>(file, calibration, options);
}

}  // namespace deepuav
