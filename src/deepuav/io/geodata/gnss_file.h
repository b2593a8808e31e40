#pragma once

#include <filesystem>
#include <vector>

#include "deepuav/sensors/samples.h"

namespace deepuav {

/// Whether a file holds position fixes: a GPX file, or a CSV file whose head names a latitude or
/// whose lines have 3 to 7 fields (poses have more). Throws Error naming a file that cannot be
/// read.
bool IsGnssFile(const std::filesystem::path& file);

/// Reads the fixes of a CSV or GPX (1.0, 1.1) file.
///
/// CSV: columns are found by the names in its first line, that of a simulated flight's gps0 for one
/// ("#timestamp [ns],latitude [deg],longitude [deg],altitude [m],..."); without names they are
/// time, latitude, longitude and, if there is a fourth, altitude. Times are ISO 8601 or a number in
/// the unit the name gives (s, ms, us, ns), without one in seconds, or nanoseconds where too large
/// for these; altitudes in metres unless their name says feet, km or another length. Standard
/// deviations are read where columns are called std or sigma and name east, north or up. Semicolons
/// may stand for the commas, and fields in quotes. A line without latitude, with NaN or with
/// latitude and longitude 0 is a moment without fix and left out.
///
/// GPX: all points of all tracks, which must have times.
///
/// Of several fixes with the same time the first is kept. Throws Error naming file and line for
/// what is no number, outside of the globe, at a height that nothing flies at or goes back in time,
/// and for a file without fixes.
std::vector<GnssFix> ReadGnssFile(const std::filesystem::path& file);

/// Throws Error for a fix that is nowhere on Earth; `where` is named in the message.
void CheckOnGlobe(const GnssFix& fix, const std::string& where);

/// Whether what flies can be at this altitude.
bool IsPossibleAltitude(double altitude_m);

/// The EXIF positions of a folder of photographs (here or in images/), in the order and with the
/// times that OpenDataset gives them, but without need of a calibration. Empty for a dataset of
/// another layout. Throws Error as OpenDataset does for a folder that is no dataset.
std::vector<GnssFix> ReadPhotographFixes(const std::filesystem::path& folder);

}  // namespace deepuav
