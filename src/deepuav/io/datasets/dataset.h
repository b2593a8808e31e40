#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/time.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/image/image.h"
#include "deepuav/io/datasets/damage_watch.h"
#include "deepuav/sensors/streams.h"

namespace deepuav {

/// Where a calibration is from.
struct CalibrationSource {
  std::string text = "calibrated";  ///< "EXIF focal length", "guess", ...: for a person.
  /// Standard deviation of the focal length over it; 0 for a calibration that is not to be refined.
  double focal_sigma = 0;
};

/// A sequence of images of one camera. Frames are numbered from 0 in order of time.
/// Thread-compatible: one user at a time.
class Dataset {
 public:
  virtual ~Dataset() = default;

  /// "euroc", "tum", "kitti", "photographs" or "video".
  virtual std::string Kind() const = 0;
  /// Of the images as Load gives them.
  virtual const Camera& camera() const = 0;
  /// Of the images as they are stored, which may be larger: see DatasetOptions.
  virtual const Camera& stored_camera() const { return camera(); }
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
  /// Frames loaded so far that the file holds damaged: they are given as far as they go.
  virtual int damaged() const { return 0; }
  /// The same as Load in colour (blue, green, red), reduced to `size`, which is no larger than the
  /// stored camera's. Of a JPEG that breaks off without the rows that are lost.
  virtual cv::Mat3b LoadColour(int frame, const cv::Size& size) = 0;
  /// body_from_cam where the dataset gives one (EuRoC's T_BS).
  virtual std::optional<SE3> BodyFromCam() const { return std::nullopt; }
  /// Reads what its other sensors measured. Throws Error naming file and field.
  virtual SensorStreams ReadSensors() const { return {}; }
  /// Where the calibration is from, and how far it is to be trusted.
  virtual CalibrationSource Calibration() const { return {}; }
  /// Whether the calibration is only where to start from, to be refined.
  bool CalibrationIsApproximate() const { return Calibration().focal_sigma > 0; }
};

/// How a dataset is opened.
struct DatasetOptions {
  std::filesystem::path
      camera_file;  ///< Overrides every other calibration; empty: the dataset's own.
  /// Larger images are reduced to about so many pixels, and the camera with them; 0: none are.
  double working_pixels = 1e6;
  DamageOptions damage = {};  ///< Of videos.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("working_pixels", working_pixels, "",
          "pixels to which larger images are reduced before anything looks at them; 0: none are",
          ZeroOr(Between(1e4, 4e8)));
    visit.Part("damage", damage);
  }
};

/// The size at which images of `stored` are worked on: their own where they have hardly more than
/// `working_pixels`, or those are 0.
cv::Size WorkingSize(const cv::Size& stored, double working_pixels);

/// Opens a dataset by its layout: EuRoC/ASL (mav0/), TUM RGB-D (rgb.txt), KITTI odometry (image_0,
/// times.txt, calib.txt), a folder of photographs with EXIF, or a video file. Throws Error naming
/// file and field for a missing or wrong calibration, an unknown layout, an empty folder, time
/// stamps that do not grow.
std::unique_ptr<Dataset> OpenDataset(const std::filesystem::path& path,
                                     const DatasetOptions& options = {});

}  // namespace deepuav
