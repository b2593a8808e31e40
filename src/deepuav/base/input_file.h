#pragma once

#include <filesystem>

namespace deepuav {

/// Before a file is opened to be read: throws Error naming it where it is a named pipe, on which
/// opening would wait without end. What a shell hands over as /dev/fd/N or /dev/stdin passes.
void RefuseNamedPipe(const std::filesystem::path& file);

}  // namespace deepuav
