#include "deepuav/base/error.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/datasets/layout_readers.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

std::vector<ImageFileFrame> ReadFrameList(const fs::path& folder) {
  const fs::path list = folder / "rgb.txt";
  const TextFile text(list);
  std::vector<ImageFileFrame> frames;
  frames.reserve(text.lines().size());
  std::vector<std::string_view> fields;
  for (const TextLine& line : text.lines()) {
    const std::string where = text.Where(line);
    SplitAtBlanks(line.text, &fields);
    if (fields.size() != 2) {
      throw Error("{}: {} fields in {}: expected 'seconds file'", where, fields.size(),
                  Quoted(line.text));
    }
    const Timestamp time = ParseSeconds(fields[0], where);
    CheckGrows(frames, time, where);
    frames.push_back({time, ListedImage(folder, fields[1], where)});
  }
  if (frames.empty())
    throw Error("{}: lists no frame: expected 'seconds file' lines", list.string());
  return frames;
}

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
  sequence.frames = ReadFrameList(folder);
  return MakeImageFileDataset(std::move(sequence), options);
}

}  // namespace deepuav
