#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/base/time.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/image/image.h"
#include "deepuav/sensors/streams.h"

namespace deepuav {

/// A sequence of images of one camera. Frames are numbered from 0 in order of time.
/// Thread-compatible: one user at a time.
class Dataset {
 public:
  virtual ~Dataset() = default;

  /// "euroc", "tum", "kitti", "photographs" or "video".
  virtual std::string Kind() const = 0;
  virtual const Camera& camera() const = 0;
  virtual int size() const = 0;
  virtual Timestamp Time(int frame) const = 0;
  /// The file, or the file and the frame's number for a video: for messages.
  virtual std::string Name(int frame) const = 0;
  /// The name of the image's file without its folders; for a video the name that a file of the
  /// frame would have: the video's, the frame's number from 0 with six digits, ".png".
  virtual std::string ImageName(int frame) const {
    return std::filesystem::path(Name(frame)).filename().string();
  }
  /// Throws Error naming the file when the frame cannot be read or has not the camera's size; the
  /// next can still be.
  virtual GreyImage Load(int frame) = 0;
  /// body_from_cam where the dataset gives one (EuRoC's T_BS).
  virtual std::optional<SE3> BodyFromCam() const { return std::nullopt; }
  /// Reads what its other sensors measured. Throws Error naming file and field.
  virtual SensorStreams ReadSensors() const { return {}; }
  /// Whether the calibration is only where to start from, to be refined: taken from EXIF, or
  /// `model: auto`.
  virtual bool CalibrationIsApproximate() const { return false; }
};

/// How a dataset is opened.
struct DatasetOptions {
  std::filesystem::path
      camera_file;  ///< Overrides every other calibration; empty: the dataset's own.
};

/// Opens a dataset by its layout: EuRoC/ASL (mav0/), TUM RGB-D (rgb.txt), KITTI odometry (image_0,
/// times.txt, calib.txt), a folder of photographs with EXIF, or a video file. Throws Error naming
/// file and field for a missing or wrong calibration, an unknown layout, an empty folder, time
/// stamps that do not grow.
std::unique_ptr<Dataset> OpenDataset(const std::filesystem::path& path,
                                     const DatasetOptions& options = {});

}  // namespace deepuav
