#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "deepuav/base/logging.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/datasets/layout_readers.h"
#include "deepuav/io/datasets/photo_geotags.h"
#include "deepuav/io/datasets/photograph_kinds.h"
#include "deepuav/io/datasets/photographs.h"
#include "deepuav/io/geodata/sensor_files.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kSecond = 1000000000;

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

/// Gives the few photographs without a time that of the one before them by name.
void FillTimes(std::vector<Photograph>* photographs) {
  std::vector<std::string> without;
  for (const Photograph& photograph : *photographs) {
    if (!photograph.exif.time) without.push_back(photograph.file.filename().string());
  }
  if (without.empty() || 2 * without.size() > photographs->size()) return;
  Log().warn("{} photographs without EXIF time are taken to follow those before them by name: {}",
             without.size(), fmt::join(without, ", "));
  const auto first = std::ranges::find_if(
      *photographs, [](const Photograph& photograph) { return photograph.exif.time.has_value(); });
  Timestamp time = *first->exif.time;
  for (Photograph& photograph : *photographs) {
    if (photograph.exif.time) time = *photograph.exif.time;
    photograph.exif.time = time;
  }
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
  FillTimes(photographs);
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

/// Where a table lists the photographs, only what it says counts: other positions may be of another
/// origin. Gives the table's file.
fs::path TakeGeotags(const fs::path& folder, const fs::path& images,
                     std::vector<Photograph>* photographs) {
  std::vector<fs::path> files;
  for (const Photograph& photograph : *photographs) files.push_back(photograph.file);
  const PhotoGeotags geotags = FindPhotoGeotags({images, folder}, images, files);
  if (geotags.file.empty()) return {};
  for (size_t i = 0; i < files.size(); ++i) (*photographs)[i].fix = geotags.fixes[i];
  return geotags.file;
}

/// In the order of the frames, with their times.
std::vector<GnssFix> FixesOf(const std::vector<Photograph>& photographs) {
  std::vector<GnssFix> fixes;
  for (const Photograph& photograph : photographs) {
    if (!photograph.fix) continue;
    fixes.push_back(*photograph.fix);
    fixes.back().time = *photograph.exif.time;
  }
  return fixes;
}

/// In the order of the frames, with their times.
AttitudeStream AttitudesOf(const std::vector<Photograph>& photographs, const fs::path& images) {
  AttitudeStream attitudes;
  for (const Photograph& photograph : photographs) {
    if (photograph.enu_from_cam)
      attitudes.samples.push_back({*photograph.exif.time, *photograph.enu_from_cam});
  }
  if (!attitudes.samples.empty()) attitudes.source = "XMP of " + images.string();
  return attitudes;
}

/// By the first photograph that tells; a guess where none does.
FoundCamera FindCamera(const std::vector<Photograph>& photographs, const cv::Size& size) {
  std::optional<FoundCamera> found;
  int differing = 0;
  constexpr double kSameLens = 0.01;
  for (const Photograph& photograph : photographs) {
    const auto own = CameraFromMetadata(photograph.xmp, photograph.exif, size);
    if (!found) found = own;
    if (!own) continue;
    const double focal_px = found->camera.pinhole.fx;
    if (std::abs(own->camera.pinhole.fx - focal_px) > kSameLens * focal_px) ++differing;
  }
  if (differing > 0) {
    Log().warn("{}: {} of {} photographs have another focal length than the first",
               photographs.front().file.string(), differing, photographs.size());
  }
  return found ? *found : GuessedCamera(size);
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
  KeepOneKind(&photographs);
  const fs::path geotags = TakeGeotags(folder, images, &photographs);
  ImageFileSequence sequence;
  sequence.kind = "photographs";
  sequence.frames = OrderFrames(images, &photographs);
  const SizedImage first = FirstReadable(sequence.frames);
  const fs::path camera_file = FindCameraFile(folder, images, options);
  CameraFile read{.camera = {}, .refine = true, .has_intrinsics = false};
  if (!camera_file.empty()) read = ReadCameraFile(camera_file);
  if (read.has_intrinsics) {
    sequence.calibration_file = camera_file.string();
    sequence.camera =
        CameraForSize(read.camera, first.size, first.file.string(), sequence.calibration_file);
    sequence.calibration = read.refine ? CalibrationByHand() : CalibrationSource{};
  } else {
    const FoundCamera found = FindCamera(photographs, first.size);
    sequence.camera = found.camera;
    sequence.camera.rate_hz = read.camera.rate_hz;
    sequence.calibration = found.source;
    sequence.calibration_file = found.source.text + " of " + images.string();
  }
  const std::vector<GnssFix> fixes = FixesOf(photographs);
  const AttitudeStream attitudes = AttitudesOf(photographs, images);
  Log().info("{} x {} px{}; focal length {:.0f} px ({}); GNSS in {} of {}{}{}", first.size.width,
             first.size.height,
             photographs.front().exif.camera_model.empty()
                 ? ""
                 : " by " + photographs.front().exif.camera_model,
             sequence.camera.pinhole.fx, sequence.calibration.text, fixes.size(),
             sequence.frames.size(), geotags.empty() ? "" : ", by " + geotags.string(),
             attitudes.samples.empty()
                 ? ""
                 : fmt::format("; gimbal angles in {}", attitudes.samples.size()));
  sequence.read_sensors = [folder, images, fixes, geotags, attitudes] {
    SensorStreams streams;
    streams.attitude = attitudes;
    if (!geotags.empty()) {
      streams.gnss = {.source = geotags.string(), .fixes = fixes};
      return streams;
    }
    streams.gnss = ReadGnssBeside({images, folder}, "gps");
    if (!streams.gnss.fixes.empty() || fixes.empty()) return streams;
    streams.gnss = {.source = "EXIF of " + images.string(), .fixes = fixes};
    return streams;
  };
  return MakeImageFileDataset(std::move(sequence), options);
}

std::vector<GnssFix> FixesOfPhotographs(const fs::path& folder, const fs::path& images) {
  std::vector<Photograph> photographs = ListPhotographs(images);
  KeepOneKind(&photographs);
  TakeGeotags(folder, images, &photographs);
  OrderFrames(images, &photographs);
  return FixesOf(photographs);
}

}  // namespace deepuav
