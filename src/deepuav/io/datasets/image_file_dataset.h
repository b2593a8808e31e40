#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/io/datasets/dataset.h"

namespace deepuav {

struct ImageFileFrame {
  Timestamp time;
  std::filesystem::path file;
};

/// What the readers of image folders find out, each in its own way.
struct ImageFileSequence {
  std::string kind;
  Camera camera;                 ///< Of the images as stored.
  std::string calibration_file;  ///< For messages.
  CalibrationSource calibration;
  std::optional<SE3> body_from_cam;
  std::vector<ImageFileFrame> frames;           ///< By growing time.
  std::function<SensorStreams()> read_sensors;  ///< Nothing: there is no other sensor.
};

/// The dataset of the sequence, at the working size of the options. A camera without a rate gets
/// that of the median interval. Throws Error when there is no frame, none can be read, or the first
/// readable one has not the camera's size.
std::unique_ptr<Dataset> MakeImageFileDataset(ImageFileSequence sequence,
                                              const DatasetOptions& options);

struct SizedImage {
  std::filesystem::path file;
  cv::Size size;
};

/// The first image that can be read. Throws Error naming the first file when there is none.
SizedImage FirstReadable(const std::vector<ImageFileFrame>& frames);

/// The size that the header of the image's file tells; without decoding it, where the format is one
/// of EncodedSize. Nothing for what cannot be read.
std::optional<cv::Size> StoredSize(const std::filesystem::path& file);

/// Whether the name ends as a photograph's does (jpg, jpeg, png, tif, tiff, webp, bmp; either
/// case).
bool IsImageFileName(const std::filesystem::path& file);

}  // namespace deepuav
