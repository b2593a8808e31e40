#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "deepuav/base/sha256.h"
#include "deepuav/io/files/section_file.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/io/testing/map_test_support.h"

namespace deepuav {

inline constexpr std::string_view kMagic = "\x89UAVMAP\n";
inline constexpr uint32_t kVersion = 4;
inline constexpr size_t kHeaderBytes = 12, kHeadBytes = 24, kDigestBytes = 32;

struct Section {
  SectionKind kind;
  std::string content;
};

template <typename Number>
std::string Bytes(Number number) {
  return {reinterpret_cast<const char*>(&number), sizeof(number)};
}

/// One section as docs/map-format.md states it.
inline std::string SealedSection(const SectionKind& kind, uint32_t codec, uint64_t content_bytes,
                                 const std::string& stored) {
  std::string bytes(kind.data(), kind.size());
  bytes += Bytes(codec) + Bytes(content_bytes) + Bytes(uint64_t{stored.size()}) + stored;
  const std::string hex = Sha256(bytes);
  for (size_t i = 0; i < hex.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  }
  return bytes;
}

/// A file of the sections whose checksums hold.
inline std::string Sealed(const std::vector<Section>& sections) {
  std::string bytes = std::string(kMagic) + Bytes(kVersion);
  for (const Section& section : sections) {
    bytes += SealedSection(section.kind, 0, section.content.size(), section.content);
  }
  return bytes + SealedSection({'E', 'N', 'D', ' '}, 0, 0, "");
}

class MapFileTest : public ::testing::Test {
 protected:
  std::string WriteAtlas(const Atlas& atlas) {
    WriteMapFile(file_, atlas, TestMapCamera(), TestMapOrigin());
    return ReadAll(file_);
  }
  std::string SmallFile() { return WriteAtlas(TestAtlas(7, 6, 4, 1)); }

  LoadedAtlas ReadBytesAsMap(const std::string& bytes) {
    return ReadMapFile(folder_.Write("damaged.deepuav", bytes));
  }
  std::string ErrorOfBytes(const std::string& bytes) {
    const std::string message = ErrorOf([&] { ReadBytesAsMap(bytes); });
    EXPECT_THAT(message, testing::HasSubstr("damaged.deepuav: "));
    return message;
  }

  /// The sections of the file, without the end.
  std::vector<Section> Sections(const std::string& bytes) {
    std::vector<Section> sections;
    SectionReader reader(folder_.Write("whole.deepuav", bytes), kMagic, kVersion, kVersion);
    for (size_t at = kHeaderBytes;;) {
      SectionKind kind;
      std::copy_n(bytes.begin() + static_cast<ptrdiff_t>(at), kind.size(), kind.begin());
      if (std::string_view(kind.data(), kind.size()) == "END ") return sections;
      sections.push_back({kind, std::string(reader.Read(kind))});
      uint64_t stored_bytes;
      std::memcpy(&stored_bytes, bytes.data() + at + 16, sizeof(stored_bytes));
      at += kHeadBytes + stored_bytes + kDigestBytes;
    }
  }
  LoadedAtlas ReadSections(const std::vector<Section>& sections) {
    return ReadBytesAsMap(Sealed(sections));
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "map.deepuav";
};

}  // namespace deepuav
