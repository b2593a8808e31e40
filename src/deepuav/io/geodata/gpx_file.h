#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "deepuav/io/geodata/gnss_file.h"

namespace deepuav {

/// Calls `take(fix, where)` for each track point of a GPX file, in the file's order; `where` is
/// "file:line". Throws Error naming file and line.
void VisitGpxPoints(const std::filesystem::path& file,
                    const std::function<void(const GnssFix&, const std::string& where)>& take);

}  // namespace deepuav
