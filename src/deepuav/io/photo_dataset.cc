#include <algorithm>
#include <cmath>
#include <cstring>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/camera_file.h"
#include "deepuav/io/exif.h"
#include "deepuav/io/image_file_dataset.h"
#include "deepuav/io/layout_readers.h"
#include "deepuav/io/sensor_files.h"
#include "deepuav/io/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

struct Photograph {
  fs::path file;
  PhotoExif exif;
};

// By name, numbers in it by their value: IMG_9 before IMG_10.
std::vector<Photograph> ListPhotographs(const fs::path& images) {
  std::vector<Photograph> photographs;
  for (const auto& entry : fs::directory_iterator(images)) {
    if (IsImageFileName(entry.path())) photographs.push_back({entry.path(), {}});
  }
  std::sort(photographs.begin(), photographs.end(), [](const Photograph& a, const Photograph& b) {
    return ::strverscmp(a.file.c_str(), b.file.c_str()) < 0;
  });
  for (Photograph& photograph : photographs) {
    try {
      photograph.exif = ReadExif(photograph.file);
    } catch (const Error& error) {  // Load() will say so again, when the frame's turn comes.
      Log().warn("{}", error.what());
    }
  }
  return photographs;
}

constexpr int64_t kSecond = 1000000000;
/// Many cameras write altitudes from another origin, or the barometer's.
constexpr double kAltitudeSigma_m = 10;

/// Gives photographs of the same time, as cameras that leave out fractions of a second write them,
/// equal parts of the second or of what passes until the next. Says no where all have one time, or
/// more than a camera takes in a second: that is when they were copied.
bool SpreadEqualTimes(std::vector<Photograph>* sorted) {
  constexpr int64_t kMostInOneSecond = 30;
  const auto end = sorted->end();
  for (auto first = sorted->begin(); first != end;) {
    const int64_t time = first->exif.time->nanoseconds;
    const auto next =
        std::find_if(first, end, [&](const auto& p) { return p.exif.time->nanoseconds != time; });
    const int64_t count = next - first;
    if (count > kMostInOneSecond || (count > 1 && count == std::ssize(*sorted))) return false;
    const int64_t passes =
        next == end ? kSecond : std::min(kSecond, next->exif.time->nanoseconds - time);
    for (int64_t i = 0; i < count; ++i, ++first)
      first->exif.time->nanoseconds = time + i * passes / count;
  }
  return true;
}

bool SortByTime(std::vector<Photograph>* photographs) {
  if (!std::all_of(photographs->begin(), photographs->end(),
                   [](const auto& p) { return p.exif.time; }))
    return false;
  std::vector<Photograph> sorted = *photographs;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return *a.exif.time < *b.exif.time; });
  if (!SpreadEqualTimes(&sorted)) return false;
  *photographs = std::move(sorted);
  return true;
}

std::vector<ImageFileFrame> OrderFrames(const fs::path& images,
                                        std::vector<Photograph>* photographs) {
  const bool timed = SortByTime(photographs);
  Log().info("{}: {} photographs, times {}", images.string(), photographs->size(),
             timed ? "from EXIF"
                   : "of one second each by name, as EXIF times are missing or all the same");
  std::vector<ImageFileFrame> frames;
  frames.reserve(photographs->size());
  for (Photograph& photograph : *photographs) {
    if (!timed) photograph.exif.time = Timestamp{std::ssize(frames) * kSecond};
    frames.push_back({*photograph.exif.time, photograph.file});
  }
  return frames;
}

/// In the order of the frames, with their times.
std::vector<GnssFix> FixesOf(const std::vector<Photograph>& photographs) {
  std::vector<GnssFix> fixes;
  for (const Photograph& photograph : photographs) {
    if (!photograph.exif.fix) continue;
    fixes.push_back(*photograph.exif.fix);
    fixes.back().time = *photograph.exif.time;
    fixes.back().sigma_m.z() = kAltitudeSigma_m;
  }
  return fixes;
}

Camera CameraFromExif(const std::vector<Photograph>& photographs,
                      const std::vector<ImageFileFrame>& frames) {
  const cv::Size size = FirstReadable(frames).size;
  std::optional<double> focal;
  int differing = 0;
  constexpr double kSameLens = 0.01;
  for (const Photograph& photograph : photographs) {
    const std::optional<double> own = FocalLengthPx(photograph.exif, size.width, size.height);
    if (!focal) focal = own;
    if (own && std::abs(*own - *focal) > kSameLens * *focal) ++differing;
  }
  const Photograph& first = photographs.front();
  if (!focal) {
    throw Error(
        "{}: EXIF gives no focal length (camera model {}): expected FocalLengthIn35mmFilm, or "
        "FocalLength with "
        "FocalPlaneXResolution or a known camera, or a camera.yaml in the folder",
        first.file.string(), Quoted(first.exif.camera_model));
  }
  if (differing > 0) {
    Log().warn("{}: {} of {} photographs have another focal length than the first",
               first.file.string(), differing, photographs.size());
  }
  Log().info("focal length from EXIF: {:.1f} px", *focal);
  Camera camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.pinhole = {*focal, *focal, (size.width - 1) / 2.0, (size.height - 1) / 2.0};
  return camera;
}

fs::path FindCameraFile(const fs::path& folder, const fs::path& images,
                        const DatasetOptions& options) {
  if (!options.camera_file.empty()) return options.camera_file;
  for (const fs::path& candidate : {images / "camera.yaml", folder / "camera.yaml"}) {
    if (fs::exists(candidate)) return candidate;
  }
  return {};
}

}  // namespace

std::unique_ptr<Dataset> OpenPhotographs(const fs::path& folder, const fs::path& images,
                                         const DatasetOptions& options) {
  std::vector<Photograph> photographs = ListPhotographs(images);
  ImageFileSequence sequence;
  sequence.kind = "photographs";
  sequence.frames = OrderFrames(images, &photographs);
  const fs::path camera_file = FindCameraFile(folder, images, options);
  CameraFile read{.camera = {}, .refine = true, .has_intrinsics = false};
  if (!camera_file.empty()) read = ReadCameraFile(camera_file);
  sequence.calibration_file =
      camera_file.empty() ? "EXIF of " + images.string() : camera_file.string();
  if (!read.has_intrinsics) {
    const double rate_hz = read.camera.rate_hz;
    read.camera = CameraFromExif(photographs, sequence.frames);
    read.camera.rate_hz = rate_hz;
  }
  sequence.camera = std::move(read.camera);
  sequence.calibration_is_approximate = read.refine;
  sequence.read_sensors = [folder, images, fixes = FixesOf(photographs)] {
    SensorStreams streams;
    streams.gnss = ReadGnssBeside({images, folder}, "gps");
    if (!streams.gnss.fixes.empty() || fixes.empty()) return streams;
    streams.gnss = {.source = "EXIF of " + images.string(), .fixes = fixes};
    return streams;
  };
  return MakeImageFileDataset(std::move(sequence));
}

std::vector<GnssFix> FixesOfPhotographs(const fs::path& images) {
  std::vector<Photograph> photographs = ListPhotographs(images);
  OrderFrames(images, &photographs);
  return FixesOf(photographs);
}

}  // namespace deepuav
