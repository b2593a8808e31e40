#include "deepuav/io/geodata/mp4_track.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/io/files/big_endian.h"

namespace deepuav {
namespace {

constexpr uint64_t kMaxTablesBytes = uint64_t{64} << 20, kMaxSampleBytes = uint64_t{16} << 20;
constexpr size_t kMostSamples = size_t{1} << 22;
constexpr double kLongest_s = 1e9;
constexpr size_t kHeadBytes = 8, kLongHeadBytes = 16;
constexpr size_t kVersionBytes = 4;  // Version and flags, at the start of most boxes.

/// The content of the first box of a type among `bytes` that is accepted.
std::optional<std::string_view> FindBox(std::string_view bytes, std::string_view type,
                                        const std::function<bool(std::string_view)>& accepts) {
  while (bytes.size() >= kHeadBytes) {
    uint64_t size = GetBigEndian<uint32_t>(bytes, 0);
    size_t head = kHeadBytes;
    if (size == 1 && bytes.size() >= kLongHeadBytes) {
      size = GetBigEndian<uint64_t>(bytes, kHeadBytes);
      head = kLongHeadBytes;
    }
    if (size == 0) size = bytes.size();
    if (size < head || size > bytes.size()) return std::nullopt;
    const std::string_view content = bytes.substr(head, static_cast<size_t>(size) - head);
    if (bytes.substr(4, 4) == type && accepts(content)) return content;
    bytes.remove_prefix(static_cast<size_t>(size));
  }
  return std::nullopt;
}

std::optional<std::string_view> Child(std::string_view bytes, std::string_view type) {
  return FindBox(bytes, type, [](std::string_view) { return true; });
}

std::optional<std::string_view> Below(std::string_view bytes,
                                      std::initializer_list<std::string_view> path) {
  std::optional<std::string_view> at = bytes;
  for (const std::string_view type : path) {
    if (at) at = Child(*at, type);
  }
  return at;
}

/// The moov box of the file: what describes its tracks.
std::string ReadTables(std::ifstream* stream, uint64_t file_size) {
  for (uint64_t at = 0; at + kHeadBytes <= file_size;) {
    std::string head(kLongHeadBytes, '\0');
    stream->clear();
    stream->seekg(static_cast<std::streamoff>(at));
    stream->read(head.data(), static_cast<std::streamsize>(head.size()));
    uint64_t size = GetBigEndian<uint32_t>(head, 0);
    size_t head_bytes = kHeadBytes;
    if (size == 1) {
      size = GetBigEndian<uint64_t>(head, kHeadBytes);
      head_bytes = kLongHeadBytes;
    }
    if (size == 0) size = file_size - at;
    if (size < head_bytes || size > file_size - at) return {};
    if (head.compare(4, 4, "moov") == 0) {
      if (size > kMaxTablesBytes) return {};
      std::string content(static_cast<size_t>(size) - head_bytes, '\0');
      stream->clear();
      stream->seekg(static_cast<std::streamoff>(at + head_bytes));
      stream->read(content.data(), static_cast<std::streamsize>(content.size()));
      return *stream ? content : std::string();
    }
    at += size;
  }
  return {};
}

/// The 32-bit numbers of a table, `columns` a row, behind its version and the number of rows at
/// `count_at`.
std::vector<uint32_t> Table(std::optional<std::string_view> box, size_t columns,
                            size_t count_at = kVersionBytes) {
  if (!box || box->size() < count_at + 4) return {};
  const std::string_view rows = box->substr(count_at + 4);
  const uint64_t count = GetBigEndian<uint32_t>(*box, count_at);
  if (count > rows.size() / (4 * columns)) return {};
  std::vector<uint32_t> numbers;
  for (size_t i = 0; i < count * columns; ++i)
    numbers.push_back(GetBigEndian<uint32_t>(rows, 4 * i));
  return numbers;
}

struct SampleTables {
  double seconds_a_tick = 0;
  std::vector<uint32_t> sizes, durations;   ///< Runs of (count, ticks) make the durations.
  std::vector<uint64_t> chunks;             ///< Where they begin in the file.
  std::vector<uint32_t> samples_of_chunks;  ///< Runs of (first chunk from 1, samples, entry).
};

std::vector<uint64_t> ChunkOffsets(std::string_view tables) {
  std::vector<uint64_t> offsets;
  for (const uint32_t offset : Table(Child(tables, "stco"), 1)) offsets.push_back(offset);
  const std::vector<uint32_t> halves = Table(Child(tables, "co64"), 2);
  for (size_t i = 0; i + 1 < halves.size(); i += 2)
    offsets.push_back(uint64_t{halves[i]} << 32 | halves[i + 1]);
  return offsets;
}

std::vector<uint32_t> SampleSizes(std::string_view tables, size_t most) {
  const auto box = Child(tables, "stsz");
  constexpr size_t kCountAt = 8;
  if (!box || box->size() < kCountAt + 4) return {};
  const uint32_t same = GetBigEndian<uint32_t>(*box, kVersionBytes);
  if (same == 0) return Table(box, 1, kCountAt);
  return std::vector<uint32_t>(std::min(size_t{GetBigEndian<uint32_t>(*box, kCountAt)}, most),
                               same);
}

SampleTables ReadSampleTables(std::string_view track, uint64_t file_size) {
  SampleTables tables;
  const auto media = Child(track, "mdhd");
  if (!media || media->empty()) return tables;
  const size_t scale_at = (*media)[0] == 1 ? 20 : 12;
  if (media->size() < scale_at + 4) return tables;
  const uint32_t ticks = GetBigEndian<uint32_t>(*media, scale_at);
  const auto samples = Below(track, {"minf", "stbl"});
  if (!samples || ticks == 0) return tables;
  tables.seconds_a_tick = 1.0 / ticks;
  tables.sizes = SampleSizes(*samples, std::min(kMostSamples, static_cast<size_t>(file_size)));
  tables.durations = Table(Child(*samples, "stts"), 2);
  tables.chunks = ChunkOffsets(*samples);
  tables.samples_of_chunks = Table(Child(*samples, "stsc"), 3);
  return tables;
}

/// Where each sample begins in the file.
std::vector<uint64_t> SampleOffsets(const SampleTables& tables) {
  std::vector<uint64_t> offsets;
  size_t run = 0;
  for (size_t chunk = 0; chunk < tables.chunks.size(); ++chunk) {
    while (3 * (run + 1) < tables.samples_of_chunks.size() &&
           tables.samples_of_chunks[3 * (run + 1)] <= chunk + 1)
      ++run;
    if (3 * run + 1 >= tables.samples_of_chunks.size()) break;
    uint64_t at = tables.chunks[chunk];
    for (uint32_t i = 0; i < tables.samples_of_chunks[3 * run + 1]; ++i) {
      if (offsets.size() == tables.sizes.size()) return offsets;
      offsets.push_back(at);
      at += tables.sizes[offsets.size() - 1];
    }
  }
  return offsets;
}

}  // namespace

std::vector<Mp4Sample> ReadMp4Track(const std::filesystem::path& file, std::string_view format) {
  RefuseNamedPipe(file);
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) throw Error("{}: cannot be opened", file.string());
  const auto file_size = static_cast<uint64_t>(stream.tellg());
  const std::string moov = ReadTables(&stream, file_size);
  const auto is_wanted = [format](std::string_view track) {
    constexpr size_t kFormatAt = 12;  // Behind version, number of entries and the entry's size.
    const auto entries = Below(track, {"mdia", "minf", "stbl", "stsd"});
    return entries && entries->size() >= kFormatAt + 4 && entries->substr(kFormatAt, 4) == format;
  };
  const auto track = FindBox(moov, "trak", is_wanted);
  if (!track) return {};
  const SampleTables tables = ReadSampleTables(*Child(*track, "mdia"), file_size);
  const std::vector<uint64_t> offsets = SampleOffsets(tables);
  std::vector<Mp4Sample> samples;
  uint64_t ticks = 0;
  size_t run = 0;
  uint32_t left_in_run = tables.durations.empty() ? 0 : tables.durations[0];
  for (size_t i = 0; i < offsets.size(); ++i) {
    while (left_in_run == 0 && 2 * (run + 1) < tables.durations.size())
      left_in_run = tables.durations[2 * ++run];
    if (left_in_run == 0) break;
    --left_in_run;
    const uint32_t duration = tables.durations[2 * run + 1];
    const double start_s = static_cast<double>(ticks) * tables.seconds_a_tick;
    if (start_s > kLongest_s) break;
    const uint64_t size = tables.sizes[i];
    if (size <= kMaxSampleBytes && offsets[i] <= file_size && size <= file_size - offsets[i]) {
      Mp4Sample& sample = samples.emplace_back();
      sample.start = {std::llround(1e9 * start_s)};
      sample.duration_s = duration * tables.seconds_a_tick;
      sample.bytes.resize(static_cast<size_t>(size));
      stream.clear();
      stream.seekg(static_cast<std::streamoff>(offsets[i]));
      stream.read(sample.bytes.data(), static_cast<std::streamsize>(size));
    }
    ticks += duration;
  }
  return samples;
}

}  // namespace deepuav
