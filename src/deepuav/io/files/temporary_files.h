#pragma once

#include <filesystem>

namespace deepuav {

/// What RemoveTemporaryFiles() removes from now on. Of more than fit into a fixed table, which a
/// signal handler can read, the rest is left out.
void RememberTemporaryFile(const std::filesystem::path& file);
/// Not any more.
void ForgetTemporaryFile(const std::filesystem::path& file);

/// For a signal handler that is about to end the program. Async-signal-safe.
void RemoveTemporaryFiles() noexcept;

}  // namespace deepuav
