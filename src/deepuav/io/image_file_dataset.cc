#include "deepuav/io/image_file_dataset.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "deepuav/base/error.h"
#include "deepuav/io/camera_file.h"
#include "deepuav/io/text_file.h"

namespace deepuav {
namespace {

double MedianRateHz(const std::vector<ImageFileFrame>& frames) {
  if (frames.size() < 2) return 0;
  std::vector<double> intervals;
  intervals.reserve(frames.size() - 1);
  for (size_t i = 1; i < frames.size(); ++i) {
    intervals.push_back(SecondsBetween(frames[i - 1].time, frames[i].time));
  }
  const auto middle = intervals.begin() + static_cast<ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return 1 / *middle;
}

void CheckSize(const std::string& file, cv::Size size, const Camera& camera,
               const std::string& calibration_file) {
  if (size.width == camera.width && size.height == camera.height) return;
  throw Error("{}: image is {}x{}: expected {}x{} as in {}", file, size.width, size.height,
              camera.width, camera.height, calibration_file);
}

class ImageFileDataset : public Dataset {
 public:
  explicit ImageFileDataset(ImageFileSequence sequence) : sequence_(std::move(sequence)) {}

  std::string Kind() const override { return sequence_.kind; }
  const Camera& camera() const override { return sequence_.camera; }
  int size() const override { return static_cast<int>(sequence_.frames.size()); }
  Timestamp Time(int frame) const override { return At(frame).time; }
  std::string Name(int frame) const override { return At(frame).file.string(); }
  GreyImage Load(int frame) override {
    GreyImage image = LoadGrey(At(frame).file);
    CheckSize(Name(frame), image.size(), sequence_.camera, sequence_.calibration_file);
    return image;
  }
  std::optional<SE3> BodyFromCam() const override { return sequence_.body_from_cam; }
  SensorStreams ReadSensors() const override {
    return sequence_.read_sensors ? sequence_.read_sensors() : SensorStreams{};
  }
  bool CalibrationIsApproximate() const override { return sequence_.calibration_is_approximate; }

 private:
  const ImageFileFrame& At(int frame) const {
    if (frame < 0 || frame >= size()) throw Error("frame {}: expected 0 to {}", frame, size() - 1);
    return sequence_.frames[static_cast<size_t>(frame)];
  }

  ImageFileSequence sequence_;
};

}  // namespace

std::unique_ptr<Dataset> MakeImageFileDataset(ImageFileSequence sequence) {
  sequence.camera.Check(sequence.calibration_file);
  const SizedImage first = FirstReadable(sequence.frames);
  if (std::max(first.size.width, first.size.height) > kMaxImageSidePx) {
    throw Error("{}: image is {}x{}: expected sides of at most {}", first.file.string(),
                first.size.width, first.size.height, kMaxImageSidePx);
  }
  CheckSize(first.file.string(), first.size, sequence.camera, sequence.calibration_file);
  if (sequence.camera.rate_hz == 0) sequence.camera.rate_hz = MedianRateHz(sequence.frames);
  return std::make_unique<ImageFileDataset>(std::move(sequence));
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

void CheckGrows(const std::vector<ImageFileFrame>& frames, Timestamp time,
                const std::string& where) {
  if (frames.empty() || frames.back().time < time) return;
  throw Error(
      "{}: time stamp {} ns does not come after the one before, {} ns: expected growing times",
      where, time.nanoseconds, frames.back().time.nanoseconds);
}

std::filesystem::path ListedImage(const std::filesystem::path& folder, std::string_view name,
                                  const std::string& where) {
  const bool has_control =
      std::any_of(name.begin(), name.end(), [](unsigned char c) { return std::iscntrl(c) != 0; });
  if (name.empty() || has_control) {
    throw Error("{}: file name is {}: expected the name of an image", where, Quoted(name));
  }
  return folder / std::filesystem::path(name);
}

bool IsImageFileName(const std::filesystem::path& file) {
  static const std::array<std::string, 5> kEndings = {".jpg", ".jpeg", ".png", ".tif", ".tiff"};
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool hidden = file.filename().string().starts_with('.');
  return !hidden && std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

}  // namespace deepuav
