#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/geodata/gnss_file.h"

namespace deepuav {

/// The readers behind OpenDataset, one file each. Every one throws Error as OpenDataset does.

/// `mav0`: the folder with cam0/data.csv and cam0/sensor.yaml of the EuRoC/ASL format.
std::unique_ptr<Dataset> OpenEuroc(const std::filesystem::path& mav0,
                                   const DatasetOptions& options);

/// `folder` with rgb.txt ("seconds file") and camera.yaml.
std::unique_ptr<Dataset> OpenTum(const std::filesystem::path& folder,
                                 const DatasetOptions& options);

/// `folder` with image_0/NNNNNN.png, times.txt (seconds) and calib.txt (P0).
std::unique_ptr<Dataset> OpenKitti(const std::filesystem::path& folder,
                                   const DatasetOptions& options);

/// Photographs in `images`; a camera.yaml is looked for there and in `folder`. Times, fixes and the
/// focal length come from EXIF.
std::unique_ptr<Dataset> OpenPhotographs(const std::filesystem::path& folder,
                                         const std::filesystem::path& images,
                                         const DatasetOptions& options);

/// The positions of those photographs.
std::vector<GnssFix> FixesOfPhotographs(const std::filesystem::path& folder,
                                        const std::filesystem::path& images);

/// A video with STEM.yaml or camera.yaml beside it.
std::unique_ptr<Dataset> OpenVideo(const std::filesystem::path& file,
                                   const DatasetOptions& options);

}  // namespace deepuav
