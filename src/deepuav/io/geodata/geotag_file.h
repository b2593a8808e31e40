#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deepuav/sensors/samples.h"

namespace deepuav {

/// Where a photograph was taken, as a table says it; without a time.
struct Geotag {
  std::string image;  ///< Its name in the table, with or without folders and ending.
  GnssFix fix;
};

/// Whether a file lists positions of images by their names, as ReadGeotagFile reads them. Throws
/// Error naming a file that cannot be read.
bool IsGeotagFile(const std::filesystem::path& file);

/// Reads positions of images, as programs that compute them afterwards (PPK) and other
/// photogrammetry write them.
///
/// A table with a head: fields separated by commas, semicolons or tabs; columns are found by their
/// names: that of the image (image, file, photo, label or name), latitude, longitude and, where
/// they are there, altitude and accuracies or standard deviations (horizontal, vertical, or each
/// axis). Without a head they are image, latitude, longitude, altitude, as Pix4D has them.
///
/// OpenDroneMap's geo.txt: a line with the reference system, then "image x y [z [yaw pitch roll
/// [horizontal accuracy [vertical accuracy]]]]", separated by blanks.
///
/// Altitudes are metres unless the name says another unit. Rows without a position are left out.
/// Throws Error naming file and line for what is no number or not on Earth, and for a file that
/// lists none.
std::vector<Geotag> ReadGeotagFile(const std::filesystem::path& file);

/// The tables of positions among the .csv and .txt files of the folders, each folder's by name. One
/// that cannot be read is logged and passed over.
std::vector<std::filesystem::path> FindGeotagsBeside(
    const std::vector<std::filesystem::path>& folders);

}  // namespace deepuav
