#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/datasets/frame_list.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/datasets/kitti_calibration.h"
#include "deepuav/io/datasets/layout_readers.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

// The images are numbered from 0; a number may be missing, so names follow from the number and not
// from the listing.
struct Numbering {
  size_t digits = 6;
  std::string ending = ".png";
  int last = -1;

  std::string Name(int number) const { return fmt::format("{:0{}}{}", number, digits, ending); }
};

Numbering ReadNumbering(const fs::path& images) {
  std::vector<fs::path> names;
  for (const auto& entry : fs::directory_iterator(images)) {
    if (IsImageFileName(entry.path())) names.push_back(entry.path().filename());
  }
  if (names.empty())
    throw Error("{}: holds no image: expected 000000.png and so on", images.string());
  const fs::path& last = *std::max_element(names.begin(), names.end());
  const std::string stem = last.stem().string();
  constexpr size_t kMaxDigits = 9;  // of an int
  if (stem.size() > kMaxDigits || stem.find_first_not_of("0123456789") != std::string::npos) {
    throw Error("{}: image is called {}: expected a number such as 000000.png", images.string(),
                Quoted(last.string()));
  }
  return {stem.size(), last.extension().string(), std::stoi(stem)};
}

std::vector<ImageFileFrame> ReadFrames(const fs::path& folder) {
  const fs::path times = folder / "times.txt";
  const fs::path images = folder / "image_0";
  const TextFile text(times);
  const Numbering numbering = ReadNumbering(images);
  std::vector<ImageFileFrame> frames;
  frames.reserve(text.lines().size());
  for (const TextLine& line : text.lines()) {
    const std::string where = text.Where(line);
    const Timestamp time = ParseSeconds(line.text, where);
    CheckGrows(frames, time, where);
    frames.push_back({time, images / numbering.Name(static_cast<int>(frames.size()))});
  }
  if (numbering.last >= static_cast<int>(frames.size())) {
    throw Error("{}: holds {} times: expected {}, one for each image up to {}", times.string(),
                frames.size(), numbering.last + 1, numbering.Name(numbering.last));
  }
  return frames;
}

void ReadCalibration(const fs::path& folder, const DatasetOptions& options,
                     ImageFileSequence* sequence) {
  const fs::path calibration = folder / "calib.txt";
  if (options.camera_file.empty() && fs::exists(calibration)) {
    sequence->camera.pinhole = ReadKittiCalibration(calibration);
    const cv::Size size = FirstReadable(sequence->frames).size;
    sequence->camera.width = size.width;
    sequence->camera.height = size.height;
    sequence->calibration_file = calibration.string();
    return;
  }
  const fs::path camera_file =
      options.camera_file.empty() ? folder / "camera.yaml" : options.camera_file;
  if (options.camera_file.empty() && !fs::exists(camera_file)) {
    throw Error("{}: no calibration: expected this file, or camera.yaml beside it",
                calibration.string());
  }
  CameraFile read = ReadCompleteCameraFile(camera_file);
  sequence->camera = std::move(read.camera);
  if (read.refine) sequence->calibration = CalibrationByHand();
  sequence->calibration_file = camera_file.string();
}

}  // namespace

std::unique_ptr<Dataset> OpenKitti(const fs::path& folder, const DatasetOptions& options) {
  ImageFileSequence sequence;
  sequence.kind = "kitti";
  sequence.frames = ReadFrames(folder);
  ReadCalibration(folder, options, &sequence);
  return MakeImageFileDataset(std::move(sequence), options);
}

}  // namespace deepuav
