#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace deepuav {

/// SHA-256 (FIPS 180-4) as 64 lower-case hexadecimal digits.
std::string Sha256(std::span<const std::byte> bytes);
std::string Sha256(const std::string& text);

/// Of the files' contents, one after the other. Throws Error naming the file that cannot be read.
std::string Sha256OfFiles(const std::vector<std::filesystem::path>& files);

}  // namespace deepuav
