#include "deepuav/io/cameras/tiff_metadata.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <set>
#include <string_view>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/io/files/big_endian.h"

namespace deepuav {
namespace {

enum Tag : uint16_t {
  kImageWidth = 256,
  kMake = 271,
  kModel = 272,
  kOrientation = 274,
  kXmp = 700,
  kExifDirectory = 34665,
  kGpsDirectory = 34853,
  kMakerNote = 37500,
  kInteroperability = 40965,
};
constexpr uint16_t kLong = 4, kDirectory = 13;
constexpr size_t kHeaderBytes = 8, kEntryBytes = 12, kInlineBytes = 4;
/// By the type's number.
constexpr std::array<size_t, 14> kTypeBytes = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4};

/// One field of a directory, its value in the file's byte order.
struct Field {
  uint16_t tag = 0, type = 0;
  uint32_t count = 0;
  std::string value;
};

/// Reads fields from a TIFF. Whatever lies beyond the file's end is not there.
class TiffReader {
 public:
  explicit TiffReader(const std::filesystem::path& file) : stream_(file, std::ios::binary) {
    if (!stream_) throw Error("{}: cannot be opened for reading", file.string());
    header_ = BytesAt(0, kHeaderBytes);
  }

  bool IsTiff() const {
    using namespace std::string_view_literals;
    return header_.starts_with("II*\0"sv) || header_.starts_with("MM\0*"sv);
  }
  const std::string& header() const { return header_; }
  uint32_t first_directory() const { return Number<uint32_t>(&header_[4]); }

  /// Its fields, the first of each tag, but for those with long values; empty where there is no
  /// such directory.
  std::vector<Field> Directory(uint32_t offset) {
    constexpr uint16_t kMostFields = 1000;
    const std::string count = BytesAt(offset, 2);
    const uint16_t fields = count.empty() ? 0 : Number<uint16_t>(count.data());
    if (fields > kMostFields) return {};
    const std::string entries = BytesAt(uint64_t{offset} + 2, fields * kEntryBytes);
    std::vector<Field> directory;
    std::set<uint16_t> tags;
    for (size_t at = 0; at < entries.size(); at += kEntryBytes) {
      if (!tags.insert(Number<uint16_t>(&entries[at])).second) continue;
      if (auto field = ReadField(&entries[at])) directory.push_back(std::move(*field));
    }
    return directory;
  }

  /// Of a field that holds one: where another directory lies.
  std::optional<uint32_t> Offset(const Field& field) const {
    if ((field.type != kLong && field.type != kDirectory) || field.count != 1) return std::nullopt;
    return Number<uint32_t>(field.value.data());
  }

  template <typename T>
  T Number(const char* bytes) const {
    T number;
    std::memcpy(&number, bytes, sizeof(T));
    return header_[0] == 'I' ? number : Swapped(number);
  }
  template <typename T>
  void Append(T number, std::string* bytes) const {
    if (header_[0] != 'I') number = Swapped(number);
    bytes->append(reinterpret_cast<const char*>(&number), sizeof(T));
  }

 private:
  static_assert(std::endian::native == std::endian::little);
  template <typename T>
  static T Swapped(T number) {
    return GetBigEndian<T>({reinterpret_cast<const char*>(&number), sizeof(T)}, 0);
  }

  /// All of them, or none.
  std::string BytesAt(uint64_t offset, size_t count) {
    std::string bytes(count, '\0');
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(offset));
    stream_.read(bytes.data(), static_cast<std::streamsize>(count));
    if (static_cast<size_t>(stream_.gcount()) != count) bytes.clear();
    return bytes;
  }

  std::optional<Field> ReadField(const char* entry) {
    constexpr size_t kMostXmpBytes = size_t{512} << 10, kMostBytes = 256;
    Field field{
        Number<uint16_t>(entry), Number<uint16_t>(entry + 2), Number<uint32_t>(entry + 4), {}};
    if (field.type == 0 || field.type >= kTypeBytes.size() || field.count == 0) return std::nullopt;
    const uint64_t bytes = field.count * uint64_t{kTypeBytes[field.type]};
    if (bytes > (field.tag == kXmp ? kMostXmpBytes : kMostBytes)) return std::nullopt;
    if (bytes <= kInlineBytes) {
      field.value.assign(entry + 8, kInlineBytes);
    } else {
      field.value = BytesAt(Number<uint32_t>(entry + 8), bytes);
    }
    return field.value.empty() ? std::nullopt : std::optional(std::move(field));
  }

  std::ifstream stream_;
  std::string header_;
};

/// Appends the directory and its values to a TIFF in memory; gives where it begins.
uint32_t AppendDirectory(const TiffReader& reader, const std::vector<Field>& fields,
                         std::string* tiff) {
  const auto begin = static_cast<uint32_t>(tiff->size());
  const size_t values_at = begin + 2 + fields.size() * kEntryBytes + 4;
  std::string values;
  reader.Append(static_cast<uint16_t>(fields.size()), tiff);
  for (const Field& field : fields) {
    reader.Append(field.tag, tiff);
    reader.Append(field.type, tiff);
    reader.Append(field.count, tiff);
    if (field.value.size() <= kInlineBytes) {
      *tiff += field.value;
    } else {
      reader.Append(static_cast<uint32_t>(values_at + values.size()), tiff);
      values += field.value;
    }
  }
  reader.Append(uint32_t{0}, tiff);
  *tiff += values;
  return begin;
}

/// A directory named by a field of the first one, less what only its maker understands.
std::vector<Field> SubDirectory(uint32_t offset, TiffReader* reader) {
  constexpr size_t kMostFields = 100;  // All of a block that EXIF readers take: 64 KiB.
  std::vector<Field> fields = reader->Directory(offset);
  std::erase_if(fields, [](const Field& field) {
    return field.tag == kMakerNote || field.tag == kInteroperability;
  });
  if (fields.size() > kMostFields) fields.resize(kMostFields);
  return fields;
}

}  // namespace

std::optional<TiffMetadata> ReadTiffMetadata(const std::filesystem::path& file) {
  TiffReader reader(file);
  if (!reader.IsTiff()) return std::nullopt;
  const std::vector<Field> first = reader.Directory(reader.first_directory());
  if (first.empty()) return std::nullopt;
  TiffMetadata metadata;
  std::string& tiff = metadata.exif;
  tiff = reader.header();
  std::vector<Field> kept;
  for (const Field& field : first) {
    if (field.tag == kXmp) metadata.xmp = field.value;
    const bool is_directory = field.tag == kExifDirectory || field.tag == kGpsDirectory;
    const bool is_kept = field.tag == kImageWidth || field.tag == kMake || field.tag == kModel ||
                         field.tag == kOrientation;
    if (is_kept) kept.push_back(field);
    if (const auto offset = is_directory ? reader.Offset(field) : std::nullopt) {
      kept.push_back(field);
      kept.back().type = kLong;
      kept.back().value.clear();
      reader.Append(AppendDirectory(reader, SubDirectory(*offset, &reader), &tiff),
                    &kept.back().value);
    }
  }
  const uint32_t begin = AppendDirectory(reader, kept, &tiff);
  std::string offset;
  reader.Append(begin, &offset);
  tiff.replace(4, offset.size(), offset);
  return metadata;
}

}  // namespace deepuav
