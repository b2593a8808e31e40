#include "deepuav/io/files/section_file.h"

#include <zstd.h>

#include "deepuav/base/error.h"
#include "deepuav/base/sha256.h"
#include "deepuav/io/files/byte_stream.h"

namespace deepuav {
namespace {

constexpr SectionKind kEnd = {'E', 'N', 'D', ' '};
constexpr uint32_t kStored = 0, kZstandard = 1;
constexpr size_t kHeadBytes = 4 + 4 + 8 + 8;
constexpr size_t kDigestBytes = 32;
// 8-bit descriptors shrink by 6 % at any level up to 9, by 6.3 % at 19 and a fortieth of the speed.
constexpr int kCompressionLevel = 1;
// A reader takes no more memory than this many times what the file holds.
constexpr uint64_t kMaxExpansion = 64;

std::string_view Text(const SectionKind& kind) { return {kind.data(), kind.size()}; }

/// In single quotes, with what is no printable ASCII as \xHH.
std::string Escaped(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) {
    const bool is_printable = byte >= ' ' && byte <= '~';
    text += is_printable ? std::string(1, byte)
                         : fmt::format("\\x{:02x}", static_cast<unsigned char>(byte));
  }
  return "'" + text + "'";
}

/// The bytes of a hexadecimal digest.
std::string DigestOf(std::string_view bytes) {
  const std::string hex = Sha256(std::as_bytes(std::span(bytes)));
  std::string digest;
  for (size_t i = 0; i < hex.size(); i += 2) {
    digest += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  }
  return digest;
}

struct SectionHead {
  SectionKind kind;
  uint32_t codec = kStored;
  uint64_t content_bytes = 0, stored_bytes = 0;

  void Put(ByteWriter* writer) const {
    writer->PutAll(std::span<const char>(kind));
    writer->Put<uint32_t>(codec);
    writer->Put<uint64_t>(content_bytes);
    writer->Put<uint64_t>(stored_bytes);
  }
  static SectionHead Get(std::string_view bytes) {
    ByteReader reader(bytes, "the head of a section");
    SectionHead head;
    reader.GetAll(std::span<char>(head.kind));
    head.codec = reader.Get<uint32_t>();
    head.content_bytes = reader.Get<uint64_t>();
    head.stored_bytes = reader.Get<uint64_t>();
    return head;
  }
};

}  // namespace

struct SectionWriter::Compressor {
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  std::unique_ptr<ZSTD_CCtx, Free> context{ZSTD_createCCtx()};
  std::string compressed;

  /// The content compressed; nothing where it is as well left as it is.
  std::string_view Compress(std::string_view content) {
    compressed.resize(ZSTD_compressBound(content.size()));
    const size_t size = ZSTD_compressCCtx(context.get(), compressed.data(), compressed.size(),
                                          content.data(), content.size(), kCompressionLevel);
    const bool helps = !ZSTD_isError(size) && size < content.size() &&
                       content.size() <= kMaxExpansion * uint64_t{size};
    return {compressed.data(), helps ? size : 0};
  }
};

SectionWriter::SectionWriter(const std::filesystem::path& file, std::string_view magic,
                             uint32_t version)
    : file_(file), compressor_(std::make_unique<Compressor>()) {
  ByteWriter header;
  header.PutAll(std::span<const char>(magic));
  header.Put<uint32_t>(version);
  file_.Write(header.bytes());
}

SectionWriter::~SectionWriter() = default;

void SectionWriter::Write(const SectionKind& kind, std::string_view content) {
  const std::string_view compressed = compressor_->Compress(content);
  const std::string_view stored = compressed.empty() ? content : compressed;
  ByteWriter section;
  SectionHead{kind, compressed.empty() ? kStored : kZstandard, content.size(), stored.size()}.Put(
      &section);
  section.PutAll(std::span<const char>(stored));
  file_.Write(section.bytes());
  file_.Write(DigestOf(section.bytes()));
}

void SectionWriter::Commit() {
  Write(kEnd, "");
  file_.Commit();
}

SectionReader::SectionReader(const std::filesystem::path& file, std::string_view magic,
                             uint32_t oldest, uint32_t newest) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw Error("cannot be read: expected a file");
  }
  size_ = std::filesystem::file_size(file, error);
  stream_.open(file, std::ios::binary);
  if (error || !stream_) throw Error("cannot be read");

  const size_t header_bytes = magic.size() + sizeof(uint32_t);
  ReadExactly(&stored_, 0, std::min<uint64_t>(size_, header_bytes));
  if (!std::string_view(stored_).starts_with(magic)) {
    throw Error("begins with {}: expected {}",
                Escaped(std::string_view(stored_).substr(0, magic.size())), Escaped(magic));
  }
  ByteReader header(std::string_view(stored_).substr(magic.size()), "the header");
  version_ = header.Get<uint32_t>();
  if (version_ < oldest || version_ > newest) {
    throw Error("has the format version {}{}: expected {} to {}", version_,
                version_ > newest ? ", of a newer program" : "", oldest, newest);
  }
}

void SectionReader::ReadExactly(std::string* bytes, size_t offset, size_t count) {
  if (count > size_ - position_) {
    throw Error("is truncated: {} bytes follow byte {}, expected {}", size_ - position_, position_,
                count);
  }
  bytes->resize(offset + count);
  stream_.read(bytes->data() + offset, static_cast<std::streamsize>(count));
  if (static_cast<size_t>(stream_.gcount()) != count) {
    throw Error("cannot be read from byte {}", position_);
  }
  position_ += count;
}

std::string_view SectionReader::Read(const SectionKind& kind) {
  const uint64_t begin = position_;
  const auto where = [&] {
    return fmt::format("section {} at byte {}", Escaped(Text(kind)), begin);
  };
  ReadExactly(&stored_, 0, kHeadBytes);
  const SectionHead head = SectionHead::Get(stored_);
  if (head.stored_bytes > size_ - position_) {
    throw Error("{} says that it has {} bytes: {} follow, the file is truncated or damaged",
                where(), head.stored_bytes, size_ - position_);
  }
  ReadExactly(&stored_, kHeadBytes, head.stored_bytes);
  const std::string digest = DigestOf(stored_);
  std::string written_digest;
  ReadExactly(&written_digest, 0, kDigestBytes);
  if (written_digest != digest) {
    throw Error("{} has another SHA-256 than was written: the file is damaged", where());
  }
  if (head.kind != kind) {
    throw Error("{} is {}", where(), Escaped(Text(head.kind)));
  }
  content_bytes_ += head.content_bytes;
  SectionTally& tally = tallies_[std::string(Text(kind))];
  ++tally.count;
  tally.content_bytes += head.content_bytes;
  tally.file_bytes += position_ - begin;
  const std::string_view stored = std::string_view(stored_).substr(kHeadBytes);
  if (head.codec == kStored && head.content_bytes == head.stored_bytes) return stored;
  if (head.codec != kZstandard || head.content_bytes / kMaxExpansion > head.stored_bytes) {
    throw Error(
        "{} has codec {}, {} bytes for {}: expected 0 (as it is) or 1 (Zstandard, at most "
        "{} times as much)",
        where(), head.codec, head.stored_bytes, head.content_bytes, kMaxExpansion);
  }
  content_.resize(head.content_bytes);
  const size_t size =
      ZSTD_decompress(content_.data(), content_.size(), stored.data(), stored.size());
  if (ZSTD_isError(size) || size != content_.size()) {
    throw Error("{} cannot be decompressed to {} bytes: {}", where(), content_.size(),
                ZSTD_isError(size) ? ZSTD_getErrorName(size) : "it holds fewer");
  }
  return content_;
}

bool SectionReader::NextIs(const SectionKind& kind) {
  const std::streampos here = stream_.tellg();
  SectionKind found{};
  stream_.read(found.data(), std::ssize(found));
  const bool is_same = stream_ && found == kind;
  stream_.clear();
  stream_.seekg(here);
  return is_same;
}

void SectionReader::ExpectEnd() {
  Read(kEnd);
  if (position_ != size_) {
    throw Error("{} bytes follow the end at byte {}: expected none", size_ - position_, position_);
  }
}

}  // namespace deepuav
