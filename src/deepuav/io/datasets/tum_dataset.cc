#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/datasets/frame_list.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/datasets/layout_readers.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr FrameListFormat kFormat{"seconds file", SplitAtBlanks, ParseSeconds};

}  // namespace

std::unique_ptr<Dataset> OpenTum(const fs::path& folder, const DatasetOptions& options) {
  const fs::path camera_file =
      options.camera_file.empty() ? folder / "camera.yaml" : options.camera_file;
  CameraFile read = ReadCompleteCameraFile(camera_file);
  ImageFileSequence sequence;
  sequence.kind = "tum";
  sequence.camera = std::move(read.camera);
  if (read.refine) sequence.calibration = CalibrationByHand();
  sequence.calibration_file = camera_file.string();
  sequence.frames = ReadFrameList(folder / "rgb.txt", folder, kFormat);
  return MakeImageFileDataset(std::move(sequence), options);
}

}  // namespace deepuav
