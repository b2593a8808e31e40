#include "deepuav/io/datasets/dataset.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/io/datasets/folder_contents.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/datasets/layout_readers.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

bool HoldsPhotographs(const fs::path& folder) {
  if (!fs::is_directory(folder)) return false;
  const fs::recursive_directory_iterator entries(folder,
                                                 fs::directory_options::skip_permission_denied);
  return std::any_of(begin(entries), end(entries),
                     [](const auto& entry) { return IsImageFileName(entry.path()); });
}

/// A heap of datasets would be taken for one of photographs.
void RefuseSeveralDatasets(const fs::path& path) {
  const std::vector<std::string> sequences = SequencesBelow(path);
  if (sequences.empty()) return;
  throw Error("{}: holds datasets in sub-folders: expected one of them ({})", path.string(),
              SomeOf(sequences));
}

[[noreturn]] void ThrowUnknownLayout(const fs::path& path) {
  if (fs::is_empty(path)) throw Error("{}: the folder is empty: expected a dataset", path.string());
  if (const std::string images = ForeignImagesBelow(path); !images.empty()) {
    throw Error(
        "{}: holds images of formats that cannot be read, {}: expected them converted to JPEG",
        path.string(), images);
  }
  if (const std::vector<std::string> videos = VideosIn(path); !videos.empty()) {
    throw Error("{}: is a folder of videos: expected one of them ({})", path.string(),
                SomeOf(videos));
  }
  throw Error(
      "{}: no known layout: expected EuRoC (mav0/), TUM (rgb.txt), KITTI (image_0/, times.txt, "
      "calib.txt), or "
      "photographs (jpg, png, tif, webp, bmp; here or in sub-folders)",
      path.string());
}

enum class Layout { kEuroc, kTum, kKitti, kPhotographs };

struct FoundLayout {
  Layout layout;
  fs::path images;  ///< The folder that its reader starts from.
};

FoundLayout FindLayout(const fs::path& path) {
  if (fs::is_directory(path / "mav0")) return {Layout::kEuroc, path / "mav0"};
  if (fs::is_directory(path / "cam0")) return {Layout::kEuroc, path};
  if (fs::exists(path / "rgb.txt")) return {Layout::kTum, path};
  if (fs::is_directory(path / "image_0")) return {Layout::kKitti, path};
  // Beside its folder images/ a survey often has others, of masks or of what was made of it.
  if (HoldsPhotographs(path / "images")) return {Layout::kPhotographs, path / "images"};
  RefuseSeveralDatasets(path);
  if (HoldsPhotographs(path)) return {Layout::kPhotographs, path};
  ThrowUnknownLayout(path);
}

std::unique_ptr<Dataset> OpenFolder(const fs::path& path, const DatasetOptions& options) {
  const FoundLayout found = FindLayout(path);
  switch (found.layout) {
    case Layout::kEuroc:
      return OpenEuroc(found.images, options);
    case Layout::kTum:
      return OpenTum(found.images, options);
    case Layout::kKitti:
      return OpenKitti(found.images, options);
    case Layout::kPhotographs:
      break;
  }
  return OpenPhotographs(path, found.images, options);
}

}  // namespace

void DatasetOptions::Check() const { CheckOptions("images", *this); }

cv::Size WorkingSize(const cv::Size& stored, double working_pixels) {
  // Resampling costs sharpness: not worth it for a few pixels less.
  constexpr double kWorthIt = 1.3;
  const double pixels = static_cast<double>(stored.width) * stored.height;
  if (working_pixels <= 0 || pixels <= kWorthIt * working_pixels) return stored;
  const double scale = std::sqrt(working_pixels / pixels);
  const auto side = [scale](int length) {
    return std::max(1, static_cast<int>(std::lround(scale * length)));
  };
  return {side(stored.width), side(stored.height)};
}

std::unique_ptr<Dataset> OpenDataset(const fs::path& path, const DatasetOptions& options) try {
  if (!fs::exists(path))
    throw Error("{}: there is no such file or folder: expected a dataset", path.string());
  if (fs::is_directory(path)) return OpenFolder(path, options);
  if (IsVideoFileName(path)) return OpenVideo(path, options);
  throw Error(
      "{}: is no folder and no known video: expected mp4, mov, m4v, avi, mkv, mpg, mpeg, ts or "
      "webm",
      path.string());
} catch (const fs::filesystem_error& error) {
  throw Error("{}: cannot be read: {}", error.path1().string(), error.code().message());
}

std::vector<GnssFix> ReadPhotographFixes(const fs::path& folder) try {
  const FoundLayout found = FindLayout(folder);
  if (found.layout != Layout::kPhotographs) return {};
  return FixesOfPhotographs(folder, found.images);
} catch (const fs::filesystem_error& error) {
  throw Error("{}: cannot be read: {}", error.path1().string(), error.code().message());
}

}  // namespace deepuav
