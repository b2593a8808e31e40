#include "deepuav/io/datasets/image_file_dataset.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "deepuav/base/error.h"
#include "deepuav/base/intervals.h"
#include "deepuav/geometry/camera_scale.h"
#include "deepuav/image/encoded_size.h"
#include "deepuav/image/reduced_image.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

double MedianRateHz(const std::vector<ImageFileFrame>& frames) {
  return frames.size() < 2 ? 0 : 1 / MedianInterval_s(frames);
}

void CheckSize(const std::string& file, cv::Size size, const Camera& camera,
               const std::string& calibration_file) {
  if (size.width == camera.width && size.height == camera.height) return;
  throw Error("{}: image is {}x{}: expected {}x{} as in {}", file, size.width, size.height,
              camera.width, camera.height, calibration_file);
}

class ImageFileDataset : public Dataset {
 public:
  ImageFileDataset(ImageFileSequence sequence, const cv::Size& working_size)
      : sequence_(std::move(sequence)),
        camera_(ScaledCamera(sequence_.camera, working_size.width, working_size.height)) {}

  std::string Kind() const override { return sequence_.kind; }
  const Camera& camera() const override { return camera_; }
  const Camera& stored_camera() const override { return sequence_.camera; }
  int size() const override { return static_cast<int>(sequence_.frames.size()); }
  Timestamp Time(int frame) const override { return At(frame).time; }
  std::string Name(int frame) const override { return At(frame).file.string(); }
  GreyImage Load(int frame) override {
    const fs::path& file = At(frame).file;
    const Camera& stored = sequence_.camera;
    const cv::Size size(camera_.width, camera_.height);
    if (size == cv::Size(stored.width, stored.height)) {
      GreyImage image = LoadGrey(file);
      CheckSize(Name(frame), image.size(), stored, sequence_.calibration_file);
      return image;
    }
    CheckStoredSize(frame);
    return LoadReducedGrey(file, size);
  }
  cv::Mat3b LoadColour(int frame, const cv::Size& size) override {
    CheckStoredSize(frame);
    return LoadReducedColour(At(frame).file, size);
  }
  std::optional<SE3> BodyFromCam() const override { return sequence_.body_from_cam; }
  SensorStreams ReadSensors() const override {
    return sequence_.read_sensors ? sequence_.read_sensors() : SensorStreams{};
  }
  CalibrationSource Calibration() const override { return sequence_.calibration; }

 private:
  void CheckStoredSize(int frame) const {
    if (const auto found = StoredSize(At(frame).file))
      CheckSize(Name(frame), *found, sequence_.camera, sequence_.calibration_file);
  }
  const ImageFileFrame& At(int frame) const {
    if (frame < 0 || frame >= size()) throw Error("frame {}: expected 0 to {}", frame, size() - 1);
    return sequence_.frames[static_cast<size_t>(frame)];
  }

  ImageFileSequence sequence_;
  Camera camera_;
};

}  // namespace

std::unique_ptr<Dataset> MakeImageFileDataset(ImageFileSequence sequence,
                                              const DatasetOptions& options) {
  sequence.camera.Check(sequence.calibration_file);
  const SizedImage first = FirstReadable(sequence.frames);
  if (std::max(first.size.width, first.size.height) > kMaxImageSidePx) {
    throw Error("{}: image is {}x{}: expected sides of at most {}", first.file.string(),
                first.size.width, first.size.height, kMaxImageSidePx);
  }
  CheckSize(first.file.string(), first.size, sequence.camera, sequence.calibration_file);
  if (sequence.camera.rate_hz == 0) sequence.camera.rate_hz = MedianRateHz(sequence.frames);
  return std::make_unique<ImageFileDataset>(std::move(sequence),
                                            WorkingSize(first.size, options.working_pixels));
}

std::optional<cv::Size> StoredSize(const std::filesystem::path& file) {
  // EXIF, thumbnail and what makers add come before the frame header of a JPEG.
  constexpr size_t kHeadBytes = size_t{1} << 20;
  try {
    const std::string head = ReadHead(file, kHeadBytes);
    const auto size = EncodedSize({reinterpret_cast<const uint8_t*>(head.data()), head.size()});
    if (!size) return LoadGrey(file).size();
    constexpr double kMost = 1e9;  // claimed by a damaged header
    return cv::Size(static_cast<int>(std::min(size->width, kMost)),
                    static_cast<int>(std::min(size->height, kMost)));
  } catch (const Error&) {
    return std::nullopt;
  }
}

SizedImage FirstReadable(const std::vector<ImageFileFrame>& frames) {
  std::string first_reason = "there is none";
  for (size_t i = 0; i < frames.size(); ++i) {
    try {
      return {frames[i].file, LoadGrey(frames[i].file).size()};
    } catch (const Error& error) {
      if (i == 0) first_reason = error.what();
    }
  }
  throw Error("none of the {} images can be read; the first: {}", frames.size(), first_reason);
}

bool IsImageFileName(const std::filesystem::path& file) {
  static const std::array<std::string, 7> kEndings = {".jpg",  ".jpeg", ".png", ".tif",
                                                      ".tiff", ".webp", ".bmp"};
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool hidden = file.filename().string().starts_with('.');
  return !hidden && std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

}  // namespace deepuav
