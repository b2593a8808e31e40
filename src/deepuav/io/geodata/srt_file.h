#pragma once

#include <filesystem>
#include <vector>

#include "deepuav/sensors/samples.h"

namespace deepuav {

/// The fixes in the subtitles (.SRT) that DJI's drones write beside a video, on the video's clock:
/// a fix where a subtitle's position differs from the one before, at the time it appears. Read are
/// "[latitude: N] [longitude: N]" with "[altitude: N]" or "[rel_alt: N abs_alt: N]" (also spelt
/// longtitude, with blanks before the colon, within <font>), and "GPS(longitude, latitude, N)" with
/// "BAROMETER: N" or "H Nm". Of several altitudes the absolute one is taken. A subtitle without
/// position, or with latitude and longitude 0, is a moment without fix. Throws Error naming the
/// file and line for a position outside of the globe, and for a file without any subtitle.
std::vector<GnssFix> ReadSrtFile(const std::filesystem::path& file);

}  // namespace deepuav
