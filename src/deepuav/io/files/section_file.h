#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "deepuav/io/files/atomic_file.h"

namespace deepuav {

/// Four characters that say what a section holds.
using SectionKind = std::array<char, 4>;

/// What the sections of one kind take.
struct SectionTally {
  uint64_t count = 0;
  uint64_t content_bytes = 0;  ///< Uncompressed.
  uint64_t file_bytes = 0;     ///< In the file, with their heads and checksums.
};

/// A file of sections, each compressed (Zstandard, RFC 8878) where that helps and under a SHA-256
/// of its own, behind a magic number and a format version. docs/map-format.md states the bytes.
/// Appears under its name only with Commit(). Throws Error naming the file.
class SectionWriter {
 public:
  SectionWriter(const std::filesystem::path& file, std::string_view magic, uint32_t version);
  ~SectionWriter();

  void Write(const SectionKind& kind, std::string_view content);
  /// Ends the file. Nothing may be written afterwards.
  void Commit();

 private:
  struct Compressor;

  AtomicFile file_;
  std::unique_ptr<Compressor> compressor_;
};

/// Reads the sections of such a file one after the other, in memory that grows with the largest.
/// Throws Error that says what was found and what was expected, and leaves naming the file to the
/// caller: for a file that is another, newer, truncated, changed by a single bit, or followed by
/// more.
class SectionReader {
 public:
  /// Of the versions from `oldest` to `newest`.
  SectionReader(const std::filesystem::path& file, std::string_view magic, uint32_t oldest,
                uint32_t newest);

  uint32_t version() const { return version_; }
  /// The content of the next section, which must be of that kind; valid until the next call.
  std::string_view Read(const SectionKind& kind);
  /// Whether the next section is of that kind.
  bool NextIs(const SectionKind& kind);
  /// Throws Error unless the file ends here.
  void ExpectEnd();

  uint64_t content_bytes() const { return content_bytes_; }  ///< Read so far, uncompressed.
  uint64_t position() const { return position_; }            ///< Bytes of the file read so far.
  /// Of the sections read so far, by kind.
  const std::map<std::string, SectionTally>& tallies() const { return tallies_; }

 private:
  void ReadExactly(std::string* bytes, size_t offset, size_t count);

  std::ifstream stream_;
  uint32_t version_ = 0;
  uint64_t size_ = 0, position_ = 0, content_bytes_ = 0;
  std::map<std::string, SectionTally> tallies_;
  std::string stored_, content_;
};

}  // namespace deepuav
