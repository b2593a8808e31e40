#include <bit>
#include <cstring>
#include <fstream>
#include <span>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/base/sha256.h"
#include "deepuav/place/vocabulary.h"

namespace deepuav {
namespace {

static_assert(std::endian::native == std::endian::little,
              "values are written as they lie in memory, and files are little-endian");

constexpr std::string_view kMagic = "\x89UAVVOC\n";
constexpr uint32_t kVersion = 1;
constexpr size_t kDigestBytes = 64;
constexpr uint32_t kMaxDimension = 1 << 16;
// Larger than any such file can sensibly be.
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 30;

struct Header {
  uint32_t dimension = 0, nodes = 0, words = 0;
};

template <typename T>
void Put(std::span<const T> values, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

template <typename T>
void Take(std::string_view* bytes, std::span<T> values) {
  std::memcpy(values.data(), bytes->data(), values.size_bytes());
  bytes->remove_prefix(values.size_bytes());
}

uint32_t TakeNumber(std::string_view* bytes) {
  uint32_t number = 0;
  Take(bytes, std::span(&number, 1));
  return number;
}

/// Of what follows the header, without the digest. No product overflows: each factor is below 2^32,
/// the dimension's limited.
uint64_t ContentBytes(const Header& header) {
  return header.nodes * uint64_t{sizeof(uint16_t)} + header.words * uint64_t{sizeof(float)} +
         (header.nodes - uint64_t{1}) * header.dimension;
}

/// Leaves what follows magic and version.
void TakeMagic(std::string_view* bytes) {
  const std::string_view start = bytes->substr(0, kMagic.size());
  if (start.size() < kMagic.size() && kMagic.starts_with(start))
    throw Error("ends at byte {}: expected a vocabulary", bytes->size());
  if (start != kMagic) throw Error("is no vocabulary of this program");
  bytes->remove_prefix(kMagic.size());
  if (bytes->size() < sizeof(uint32_t)) throw Error("ends within its version");
  const uint32_t version = TakeNumber(bytes);
  if (version != kVersion)
    throw Error("is a vocabulary of version {}: expected {}", version, kVersion);
}

Header TakeHeader(std::string_view* bytes) {
  if (bytes->size() < sizeof(Header)) throw Error("ends within its header");
  Header header;
  header.dimension = TakeNumber(bytes);
  header.nodes = TakeNumber(bytes);
  header.words = TakeNumber(bytes);
  if (header.dimension < 1 || header.dimension > kMaxDimension) {
    throw Error("has descriptors of dimension {}: expected 1 to {}", header.dimension,
                kMaxDimension);
  }
  if (header.nodes < 2 || header.words >= header.nodes)
    throw Error("has {} nodes and {} words: expected more nodes than words", header.nodes,
                header.words);
  const uint64_t expected = ContentBytes(header) + kDigestBytes;
  if (bytes->size() != expected) {
    throw Error("has {} bytes behind its header: expected {} for {} nodes", bytes->size(), expected,
                header.nodes);
  }
  return header;
}

VocabularyTree ParseTree(std::string_view bytes) {
  const std::string_view whole = bytes;
  TakeMagic(&bytes);
  const Header header = TakeHeader(&bytes);
  const std::string_view digest = whole.substr(whole.size() - kDigestBytes);
  const std::string_view signed_bytes = whole.substr(0, whole.size() - kDigestBytes);
  if (Sha256(std::as_bytes(std::span(signed_bytes))) != digest)
    throw Error("is damaged: its SHA-256 is not the one that it states");

  VocabularyTree tree;
  tree.dimension = static_cast<int>(header.dimension);
  tree.child_counts.resize(header.nodes);
  tree.idf.resize(header.words);
  tree.centres.resize((header.nodes - size_t{1}) * header.dimension);
  Take(&bytes, std::span(tree.child_counts));
  Take(&bytes, std::span(tree.idf));
  Take(&bytes, std::span(tree.centres));
  return tree;
}

}  // namespace

std::string Vocabulary::Bytes() const {
  const Header header{static_cast<uint32_t>(dimension()), static_cast<uint32_t>(node_count()),
                      static_cast<uint32_t>(word_count())};
  const uint32_t numbers[] = {kVersion, header.dimension, header.nodes, header.words};
  std::string bytes(kMagic);
  bytes.reserve(kMagic.size() + sizeof numbers + ContentBytes(header) + kDigestBytes);
  Put(std::span<const uint32_t>(numbers), &bytes);
  Put(std::span<const uint16_t>(tree_.child_counts), &bytes);
  Put(std::span<const float>(tree_.idf), &bytes);
  Put(std::span<const int8_t>(tree_.centres), &bytes);
  bytes += Sha256(bytes);
  return bytes;
}

Vocabulary Vocabulary::FromBytes(std::string_view bytes, const std::string& name) try {
  return Vocabulary(ParseTree(bytes));
} catch (const Error& error) {
  throw Error("{}: {}", name, error.what());
}

Vocabulary Vocabulary::Load(const std::filesystem::path& file) {
  RefuseNamedPipe(file);
  std::error_code error;
  const uint64_t size = std::filesystem::file_size(file, error);
  if (error) throw Error("{}: cannot be read: {}", file.string(), error.message());
  if (size > kMaxFileBytes) {
    throw Error("{}: has {} bytes: expected a vocabulary of at most {}", file.string(), size,
                kMaxFileBytes);
  }
  std::ifstream stream(file, std::ios::binary);
  std::string bytes(static_cast<size_t>(size), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  if (!stream) throw Error("{}: cannot be read", file.string());
  return FromBytes(bytes, file.string());
}

}  // namespace deepuav
