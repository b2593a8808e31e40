#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "deepuav/base/error.h"
#include "deepuav/io/camera_file.h"
#include "deepuav/io/layout_readers.h"
#include "deepuav/io/sensor_files.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxRateHz = 10000;

class VideoDataset : public Dataset {
 public:
  VideoDataset(const fs::path& file, const fs::path& camera_file)
      : file_(file), camera_file_(camera_file), calibration_(ReadCompleteCameraFile(camera_file)) {
    Open();
    ReadRate();
    CheckSize();
    CountFrames();
  }

  std::string Kind() const override { return "video"; }
  const Camera& camera() const override { return calibration_.camera; }
  int size() const override { return frame_count_; }
  Timestamp Time(int frame) const override {
    CheckFrame(frame);
    return {std::llround(frame * (1e9 / rate_hz_))};
  }
  std::string Name(int frame) const override {
    return fmt::format("{} frame {}", file_.string(), frame);
  }
  std::string ImageName(int frame) const override {
    return fmt::format("{}_{:06}.png", file_.stem().string(), frame);
  }
  GreyImage Load(int frame) override;
  SensorStreams ReadSensors() const override { return ReadSensorsBesideVideo(file_); }
  bool CalibrationIsApproximate() const override { return calibration_.refine; }

 private:
  void Open();
  void ReadRate();
  void CheckSize();
  void CountFrames();
  void CheckFrame(int frame) const {
    if (frame < 0 || frame >= frame_count_)
      throw Error("frame {}: expected 0 to {}", frame, frame_count_ - 1);
  }

  fs::path file_, camera_file_;
  CameraFile calibration_;
  cv::VideoCapture capture_;
  int next_frame_ = 0;  ///< That grab() would yield.
  int frame_count_ = 0;
  double rate_hz_ = 0;
  cv::Mat decoded_;
};

void VideoDataset::Open() {
  next_frame_ = 0;
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
}

void VideoDataset::ReadRate() {
  Camera& camera = calibration_.camera;
  const double container_hz = capture_.get(cv::CAP_PROP_FPS);
  rate_hz_ = std::isfinite(container_hz) && container_hz > 0 && container_hz < kMaxRateHz
                 ? container_hz
                 : camera.rate_hz;
  if (rate_hz_ <= 0) {
    throw Error("{}: gives no frame rate: expected one there or as rate_hz in {}", file_.string(),
                camera_file_.string());
  }
  camera.rate_hz = rate_hz_;
}

void VideoDataset::CheckSize() {
  const int width = static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_WIDTH));
  const int height = static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_HEIGHT));
  if (width == calibration_.camera.width && height == calibration_.camera.height) return;
  throw Error("{}: image is {}x{}: expected {}x{} as in {}", file_.string(), width, height,
              calibration_.camera.width, calibration_.camera.height, camera_file_.string());
}

// Some containers do not say how many frames they hold: those are read through once.
void VideoDataset::CountFrames() {
  const double claimed = capture_.get(cv::CAP_PROP_FRAME_COUNT);
  if (claimed >= 1 && claimed < std::numeric_limits<int>::max()) {
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

GreyImage VideoDataset::Load(int frame) {
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
  if (decoded_.cols != camera().width || decoded_.rows != camera().height) {
    throw Error("{}: image is {}x{}: expected {}x{} as in {}", Name(frame), decoded_.cols,
                decoded_.rows, camera().width, camera().height, camera_file_.string());
  }
  GreyImage grey;
  if (decoded_.channels() == 1) return decoded_.clone();
  cv::cvtColor(decoded_, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

fs::path FindCameraFile(const fs::path& file, const DatasetOptions& options) {
  if (!options.camera_file.empty()) return options.camera_file;
  const fs::path same_stem = fs::path(file).replace_extension(".yaml");
  if (fs::exists(same_stem)) return same_stem;
  const fs::path in_folder = file.parent_path() / "camera.yaml";
  if (fs::exists(in_folder)) return in_folder;
  throw Error("{}: no calibration: expected {} or camera.yaml beside it", file.string(),
              same_stem.filename().string());
}

}  // namespace

std::unique_ptr<Dataset> OpenVideo(const fs::path& file, const DatasetOptions& options) {
  return std::make_unique<VideoDataset>(file, FindCameraFile(file, options));
}

}  // namespace deepuav
