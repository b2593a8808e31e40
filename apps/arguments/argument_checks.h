#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace deepuav {

/// A finite number that `suits`; `expected` says which do. CLI11's own checks let NaN pass and name
/// the largest double in full.
CLI::Validator NumberThat(bool (*suits)(double), const char* expected);

/// How many frames to render: -1 for all, or at least 1.
CLI::Validator NumberOfFrames();

/// A path that is not the empty text.
CLI::Validator NamedPath();

/// The same of an output; "-" is no name for stdout here.
CLI::Validator NamedOutput();

/// "1 map", "2 maps".
std::string Counted(size_t count, const std::string& what);

/// Before the work, not after it, it shows that this file cannot be written. Throws Error as
/// AtomicFile does; leaves nothing behind. An empty path is no file to be written.
void ProbeOutput(const std::filesystem::path& file);

/// Throws Error where the output is one of the inputs, under whatever name.
void RefuseInputAsOutput(const std::filesystem::path& output,
                         const std::vector<std::filesystem::path>& inputs);

/// What to say of words that name no command of `app`, or of the command of it that they begin
/// with; empty where they are not at fault.
std::string UnknownCommandMessage(const CLI::App& app);

}  // namespace deepuav
