#include "deepuav/io/geodata/gpmf_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "deepuav/base/error.h"
#include "deepuav/io/files/big_endian.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/geodata/mp4_track.h"

namespace deepuav {
namespace {

/// One entry of GPMF: a key, the type of its values and their bytes.
struct Entry {
  std::string_view key;
  char type = 0;
  size_t bytes_each = 0, count = 0;
  std::string_view content;
};

/// Takes the first entry off the bytes; nothing where they hold none.
std::optional<Entry> TakeEntry(std::string_view* bytes) {
  constexpr size_t kHeadBytes = 8;
  if (bytes->size() < kHeadBytes || (*bytes)[0] == 0) return std::nullopt;
  Entry entry;
  entry.key = bytes->substr(0, 4);
  entry.type = (*bytes)[4];
  entry.bytes_each = static_cast<uint8_t>((*bytes)[5]);
  entry.count = GetBigEndian<uint16_t>(*bytes, 6);
  const size_t length = entry.bytes_each * entry.count;
  if (length > bytes->size() - kHeadBytes) return std::nullopt;
  entry.content = bytes->substr(kHeadBytes, length);
  const size_t padded = (length + 3) / 4 * 4;
  bytes->remove_prefix(std::min(kHeadBytes + padded, bytes->size()));
  return entry;
}

size_t SizeOf(char type) {
  switch (type) {
    case 'b':
    case 'B':
    case 'c':
      return 1;
    case 's':
    case 'S':
      return 2;
    case 'l':
    case 'L':
    case 'f':
      return 4;
    case 'j':
    case 'J':
    case 'd':
      return 8;
    default:
      return 0;
  }
}

/// The number of a type at a place that is within the bytes.
double NumberAt(std::string_view bytes, size_t at, char type) {
  switch (type) {
    case 'b':
      return static_cast<int8_t>(bytes[at]);
    case 'B':
      return static_cast<uint8_t>(bytes[at]);
    case 's':
      return static_cast<int16_t>(GetBigEndian<uint16_t>(bytes, at));
    case 'S':
      return GetBigEndian<uint16_t>(bytes, at);
    case 'l':
      return static_cast<int32_t>(GetBigEndian<uint32_t>(bytes, at));
    case 'L':
      return GetBigEndian<uint32_t>(bytes, at);
    case 'f':
      return static_cast<double>(std::bit_cast<float>(GetBigEndian<uint32_t>(bytes, at)));
    case 'j':
      return static_cast<double>(static_cast<int64_t>(GetBigEndian<uint64_t>(bytes, at)));
    case 'J':
      return static_cast<double>(GetBigEndian<uint64_t>(bytes, at));
    case 'd':
      return std::bit_cast<double>(GetBigEndian<uint64_t>(bytes, at));
    default:
      return 0;
  }
}

/// What a stream's entries say of the values that follow them.
struct StreamState {
  std::string types;          ///< Of the fields of a record that is no array ('?').
  std::vector<double> scale;  ///< Divisors: one for all fields, or one each.
  bool has_fix = true;
};

/// The fields of record `i` of an entry, divided by their scales; nothing where they do not fit.
std::vector<double> Record(const Entry& entry, size_t i, const StreamState& state) {
  std::string types = state.types;
  if (entry.type != '?') {
    const size_t size = SizeOf(entry.type);
    if (size == 0) return {};
    types.assign(entry.bytes_each / size, entry.type);
  }
  std::vector<double> fields;
  size_t at = i * entry.bytes_each;
  const size_t end = at + entry.bytes_each;
  for (size_t k = 0; k < types.size(); ++k) {
    const size_t size = SizeOf(types[k]);
    if (size == 0 || at + size > end) return {};
    double scale = 1;
    if (!state.scale.empty()) scale = state.scale[std::min(k, state.scale.size() - 1)];
    fields.push_back(NumberAt(entry.content, at, types[k]) / (scale == 0 ? 1 : scale));
    at += size;
  }
  return fields;
}

/// Where latitude, longitude and altitude lie in the records of a key.
std::optional<size_t> FirstFieldOf(std::string_view key) {
  if (key == "GPS5" || key == "GPS9") return 0;
  if (key == "GPRI") return 1;  // behind the time
  return std::nullopt;
}

std::optional<GnssFix> FixOf(const std::vector<double>& fields, size_t first) {
  constexpr double kPole = 90, kHalfTurn = 180;
  if (fields.size() < first + 3) return std::nullopt;
  GnssFix fix;
  fix.latitude_deg = fields[first];
  fix.longitude_deg = fields[first + 1];
  fix.altitude_m = fields[first + 2];
  const bool is_place = std::abs(fix.latitude_deg) <= kPole &&
                        std::abs(fix.longitude_deg) <= kHalfTurn &&
                        IsPossibleAltitude(*fix.altitude_m);
  if (!is_place || (fix.latitude_deg == 0 && fix.longitude_deg == 0)) return std::nullopt;
  return fix;
}

/// A triaxial sensor's value.
struct TimedVector {
  Timestamp time;
  Eigen::Vector3d value;
};

class PayloadReader {
 public:
  PayloadReader(Timestamp start, double duration_s) : start_(start), duration_s_(duration_s) {}

  /// `depth`: of nesting; devices hold streams, and these hold values.
  void Read(std::string_view bytes, int depth) {
    constexpr int kDeepest = 3;
    StreamState state;
    while (const std::optional<Entry> entry = TakeEntry(&bytes)) {
      if (entry->type == 0) {
        if (depth < kDeepest) Read(entry->content, depth + 1);
        continue;
      }
      if (entry->key == "TYPE") state.types = std::string(entry->content);
      if (entry->key == "SCAL") state.scale = Scales(*entry);
      if (entry->key == "GPSF" && entry->content.size() >= 4)
        state.has_fix = GetBigEndian<uint32_t>(entry->content, 0) != 0;
      if (const auto first = FirstFieldOf(entry->key); first && state.has_fix)
        TakeFixes(*entry, *first, state);
      if (entry->key == "GYRO") TakeVectors(*entry, state, &turns_);
      if (entry->key == "ACCL") TakeVectors(*entry, state, &forces_);
    }
  }

  /// By the key of the receiver.
  const std::map<std::string, std::vector<GnssFix>>& fixes() const { return fixes_; }
  const std::vector<TimedVector>& turns() const { return turns_; }    ///< rad/s
  const std::vector<TimedVector>& forces() const { return forces_; }  ///< m/s^2

 private:
  static std::vector<double> Scales(const Entry& entry) {
    std::vector<double> scales;
    for (size_t i = 0; i < entry.count; ++i) {
      for (const double scale : Record(entry, i, {})) scales.push_back(scale);
    }
    return scales;
  }

  /// Of record `i`: they are spread evenly over the payload's time.
  Timestamp TimeOf(const Entry& entry, size_t i) const {
    const double share = static_cast<double>(i) / static_cast<double>(entry.count);
    return {start_.nanoseconds + std::llround(1e9 * duration_s_ * share)};
  }

  void TakeVectors(const Entry& entry, const StreamState& state, std::vector<TimedVector>* taken) {
    for (size_t i = 0; i < entry.count; ++i) {
      const std::vector<double> fields = Record(entry, i, state);
      if (fields.size() == 3)
        taken->push_back({TimeOf(entry, i), Eigen::Vector3d::Map(fields.data())});
    }
  }

  void TakeFixes(const Entry& entry, size_t first, const StreamState& state) {
    for (size_t i = 0; i < entry.count; ++i) {
      std::optional<GnssFix> fix = FixOf(Record(entry, i, state), first);
      if (!fix) continue;
      fix->time = TimeOf(entry, i);
      fixes_[std::string(entry.key)].push_back(*fix);
    }
  }

  Timestamp start_;
  double duration_s_;
  std::map<std::string, std::vector<GnssFix>> fixes_;
  std::vector<TimedVector> turns_, forces_;
};

/// Appends what comes after the last time.
void AppendLater(const std::vector<TimedVector>& values, std::vector<TimedVector>* all) {
  for (const TimedVector& value : values) {
    if (value.value.allFinite() && (all->empty() || all->back().time < value.time))
      all->push_back(value);
  }
}

/// At the times of the turns that lie between two forces.
std::vector<ImuSample> Joined(const std::vector<TimedVector>& turns,
                              const std::vector<TimedVector>& forces) {
  std::vector<ImuSample> samples;
  size_t next = 0;
  for (const TimedVector& turn : turns) {
    while (next < forces.size() && forces[next].time < turn.time) ++next;
    if (next == forces.size()) break;
    const TimedVector &after = forces[next], &before = forces[next == 0 ? 0 : next - 1];
    if (next == 0 && turn.time < after.time) continue;
    const double between_s = SecondsBetween(before.time, after.time);
    const double share = between_s > 0 ? SecondsBetween(before.time, turn.time) / between_s : 0;
    samples.push_back({turn.time, turn.value, (1 - share) * before.value + share * after.value});
  }
  return samples;
}

std::vector<GnssFix> Most(const std::map<std::string, std::vector<GnssFix>>& by_receiver) {
  std::vector<GnssFix> most;
  for (const auto& [receiver, fixes] : by_receiver) {
    if (fixes.size() > most.size()) most = fixes;
  }
  return most;
}

}  // namespace

std::vector<GnssFix> ParseGpmfFixes(std::string_view payload, Timestamp start, double duration_s) {
  PayloadReader reader(start, duration_s);
  reader.Read(payload, 0);
  return Most(reader.fixes());
}

std::vector<GnssFix> ReadGpmfFixes(const std::filesystem::path& file) {
  std::map<std::string, std::vector<GnssFix>> by_receiver;
  for (const Mp4Sample& sample : ReadMp4Track(file, "gpmd")) {
    PayloadReader reader(sample.start, sample.duration_s);
    reader.Read(sample.bytes, 0);
    for (const auto& [receiver, fixes] : reader.fixes()) {
      std::vector<GnssFix>& all = by_receiver[receiver];
      for (const GnssFix& fix : fixes) {
        if (all.empty() || all.back().time < fix.time) all.push_back(fix);
      }
    }
  }
  return Most(by_receiver);
}

std::vector<ImuSample> ReadGpmfImu(const std::filesystem::path& file) {
  std::vector<TimedVector> turns, forces;
  size_t usual_count = 0;
  for (const Mp4Sample& sample : ReadMp4Track(file, "gpmd")) {
    const auto read = [&sample](double duration_s) {
      PayloadReader reader(sample.start, duration_s);
      reader.Read(sample.bytes, 0);
      return reader;
    };
    PayloadReader reader = read(sample.duration_s);
    // Where the recording ends a payload holds less, at the same rate.
    const size_t count = reader.turns().size();
    if (count < usual_count / 2)
      reader =
          read(sample.duration_s * static_cast<double>(count) / static_cast<double>(usual_count));
    usual_count = std::max(usual_count, count);
    AppendLater(reader.turns(), &turns);
    AppendLater(reader.forces(), &forces);
  }
  return Joined(turns, forces);
}

}  // namespace deepuav
