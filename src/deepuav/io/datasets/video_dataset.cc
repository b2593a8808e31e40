#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/geometry/camera_scale.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/datasets/layout_readers.h"
#include "deepuav/io/datasets/video_file.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/sensor_files.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxRateHz = 10000;

/// The calibration that a file gives, if there is one.
struct VideoCalibration {
  std::optional<CameraFile> read;
  std::string file;  ///< For messages.
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

/// Told first: FFmpeg would wait for a pipe and follow a list.
const fs::path& Checked(const fs::path& file) {
  constexpr size_t kHeadBytes = 512;
  if (LooksLikeVideo(ReadHead(file, kHeadBytes))) return file;
  throw Error("{}: does not begin like a video: expected MP4, AVI, Matroska, WebM or MPEG",
              file.string());
}

class VideoDataset : public Dataset {
 public:
  VideoDataset(const fs::path& file, const VideoCalibration& calibration,
               const DatasetOptions& options)
      : file_(Checked(file)), video_(file, options.damage), packets_(video_.ReadPackets()) {
    FindCamera(calibration);
    ReadRate(calibration);
    if (packets_.count == 0 || !Advance()) {
      throw Error("{}: no frame can be decoded: the video is empty or damaged", file_.string());
    }
    const cv::Size working =
        WorkingSize({stored_camera_.width, stored_camera_.height}, options.working_pixels);
    camera_ = ScaledCamera(stored_camera_, working.width, working.height);
  }

  std::string Kind() const override { return "video"; }
  const Camera& camera() const override { return camera_; }
  const Camera& stored_camera() const override { return stored_camera_; }
  int size() const override { return packets_.count; }
  Timestamp Time(int frame) const override {
    CheckFrame(frame);
    const std::vector<int64_t>& shown_ns = packets_.shown_ns;
    if (!shown_ns.empty()) return {shown_ns[static_cast<size_t>(frame)] - shown_ns.front()};
    return {std::llround(frame * (1e9 / rate_hz_))};
  }
  std::string Name(int frame) const override {
    return fmt::format("{} frame {}", file_.string(), frame);
  }
  std::string ImageName(int frame) const override {
    return fmt::format("{}_{:06}.png", file_.stem().string(), frame);
  }
  GreyImage Load(int frame) override;
  int damaged() const override { return static_cast<int>(damaged_.size()); }
  cv::Mat3b LoadColour(int frame, const cv::Size& size) override;
  SensorStreams ReadSensors() const override { return ReadSensorsBesideVideo(file_); }
  CalibrationSource Calibration() const override { return source_; }

 private:
  void FindCamera(const VideoCalibration& calibration);
  void ReadRate(const VideoCalibration& calibration);
  /// Decodes the next picture into hand; false at the end.
  bool Advance();
  /// The frame as it is stored.
  cv::Mat Decode(int frame);
  void TellDamage(int frame);
  void CheckFrame(int frame) const {
    if (frame < 0 || frame >= packets_.count)
      throw Error("frame {}: expected 0 to {}", frame, packets_.count - 1);
  }

  const fs::path file_;
  VideoFile video_;
  const VideoFile::Packets packets_;
  Camera stored_camera_, camera_;
  CalibrationSource source_;
  double rate_hz_ = 0;
  int in_hand_ = -1;  ///< The frame that video_ decoded last; beyond the last: none.
  int last_ = std::numeric_limits<int>::max();  ///< That can be decoded, once that is known.
  bool is_damaged_ = false;
  std::set<int> damaged_;
};

void VideoDataset::FindCamera(const VideoCalibration& calibration) {
  const cv::Size size(video_.width(), video_.height());
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
  const auto degrees = video_.rotation_deg();
  const bool is_sideways = degrees % 180 != 0;
  const bool is_of_turned = (camera.width > camera.height) != (size.width > size.height);
  if (is_sideways && is_of_turned) camera = TurnedCamera(camera, -degrees / 90);
  stored_camera_ = CameraForSize(camera, size, file_.string(), calibration.file);
  if (calibration.read->refine) source_ = CalibrationByHand();
}

void VideoDataset::ReadRate(const VideoCalibration& calibration) {
  const double container_hz = video_.rate_hz();
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

/// By its time, as one that cannot be decoded is not given; else the one after the last.
bool VideoDataset::Advance() {
  const auto picture = video_.Next();
  if (!picture) {
    last_ = in_hand_;
    in_hand_ = packets_.count;  // Its pixels are gone: it is to be decoded again.
    return false;
  }
  const std::vector<int64_t>& shown_ns = packets_.shown_ns;
  const auto place = picture->shown_ns
                         ? std::lower_bound(shown_ns.begin(), shown_ns.end(), *picture->shown_ns)
                         : shown_ns.end();
  const bool is_known = place != shown_ns.end() && *place == *picture->shown_ns;
  in_hand_ = is_known ? static_cast<int>(place - shown_ns.begin()) : in_hand_ + 1;
  is_damaged_ = picture->is_damaged;
  return true;
}

cv::Mat VideoDataset::Decode(int frame) {
  CheckFrame(frame);
  if (frame > last_) throw Error("{}: cannot be decoded", Name(frame));
  if (frame < in_hand_) {
    video_.Rewind();
    in_hand_ = -1;
  }
  while (in_hand_ < frame && Advance()) {
  }
  cv::Mat decoded = in_hand_ == frame ? video_.Pixels() : cv::Mat();
  if (decoded.empty()) throw Error("{}: cannot be decoded", Name(frame));
  if (decoded.cols != stored_camera_.width || decoded.rows != stored_camera_.height) {
    throw Error("{}: image is {}x{}: expected {}x{} as the first", Name(frame), decoded.cols,
                decoded.rows, stored_camera_.width, stored_camera_.height);
  }
  if (is_damaged_) TellDamage(frame);
  return decoded;
}

void VideoDataset::TellDamage(int frame) {
  if (damaged_.empty()) {
    Log().warn("{}: is damaged, or builds on a frame that is: such frames are used as they are",
               Name(frame));
  }
  damaged_.insert(frame);
}

cv::Mat3b VideoDataset::LoadColour(int frame, const cv::Size& size) {
  cv::Mat colour = Decode(frame).clone();  // Its rows had room between them.
  if (colour.size() != size) cv::resize(colour, colour, size, 0, 0, cv::INTER_AREA);
  return colour;
}

GreyImage VideoDataset::Load(int frame) {
  GreyImage grey;
  cv::cvtColor(Decode(frame), grey, cv::COLOR_BGR2GRAY);
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
