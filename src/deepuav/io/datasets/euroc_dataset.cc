
#include "deepuav/base/error.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/datasets/euroc_sensor.h"
#include "deepuav/io/datasets/frame_list.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/datasets/layout_readers.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/sensor_files.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr FrameListFormat kFormat{"nanoseconds,file name", SplitAtCommas, ParseNanoseconds};

// The sequence's own calibration, else a camera.yaml in its folders.
void ReadCalibration(const fs::path& mav0, const DatasetOptions& options,
                     ImageFileSequence* sequence) {
  const fs::path sensor_file = mav0 / "cam0" / "sensor.yaml";
  const bool has_sensor_file = fs::exists(sensor_file);
  if (has_sensor_file) {
    EurocSensor sensor = ReadEurocSensor(sensor_file);
    sequence->body_from_cam = sensor.body_from_cam;
    sequence->camera = std::move(sensor.camera);
    sequence->calibration_file = sensor_file.string();
  }
  fs::path camera_file = options.camera_file;
  if (camera_file.empty()) {
    if (has_sensor_file) return;
    const fs::path folder = fs::absolute(mav0).lexically_normal();
    for (const fs::path& candidate :
         {folder / "camera.yaml", folder.parent_path() / "camera.yaml"}) {
      if (camera_file.empty() && fs::exists(candidate)) camera_file = candidate;
    }
  }
  if (camera_file.empty()) {
    throw Error("{}: no calibration: expected this file, or camera.yaml in {}",
                sensor_file.string(), mav0.string());
  }
  CameraFile read = ReadCompleteCameraFile(camera_file);
  sequence->camera = std::move(read.camera);
  if (read.refine) sequence->calibration = CalibrationByHand();
  sequence->calibration_file = camera_file.string();
}

}  // namespace

std::unique_ptr<Dataset> OpenEuroc(const fs::path& mav0, const DatasetOptions& options) {
  ImageFileSequence sequence;
  sequence.kind = "euroc";
  ReadCalibration(mav0, options, &sequence);
  sequence.frames = ReadFrameList(mav0 / "cam0" / "data.csv", mav0 / "cam0" / "data", kFormat);
  sequence.read_sensors = [mav0, body_from_cam = sequence.body_from_cam] {
    return ReadEurocSensors(mav0, body_from_cam);
  };
  return MakeImageFileDataset(std::move(sequence), options);
}

}  // namespace deepuav
