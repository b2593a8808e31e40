#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace deepuav {

/// The last `bytes` bytes of a number, the highest first.
inline std::string BigEndianBytes(uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i) & 0xff);
  return text;
}

inline std::string Mp4Box(const std::string& type, const std::string& content) {
  return BigEndianBytes(8 + content.size(), 4) + type + content;
}

/// An MP4 of one track whose samples, a second long each, lie one after the other in one chunk.
inline std::string Mp4WithTrack(const std::string& format,
                                const std::vector<std::string>& samples) {
  const std::string version(4, '\0');
  const auto table = [&](const std::string& type, uint64_t rows, const std::string& content) {
    return Mp4Box(type, version + BigEndianBytes(rows, 4) + content);
  };
  std::string sizes, data;
  for (const std::string& sample : samples) {
    sizes += BigEndianBytes(sample.size(), 4);
    data += sample;
  }
  const std::string file_type = Mp4Box("ftyp", "isom");
  const std::string tables =
      table("stsd", 1, BigEndianBytes(16, 4) + format + std::string(8, '\0')) +
      table("stts", 1, BigEndianBytes(samples.size(), 4) + BigEndianBytes(1000, 4)) +
      table("stsc", 1,
            BigEndianBytes(1, 4) + BigEndianBytes(samples.size(), 4) + BigEndianBytes(1, 4)) +
      Mp4Box("stsz", version + BigEndianBytes(0, 4) + BigEndianBytes(samples.size(), 4) + sizes) +
      table("stco", 1, BigEndianBytes(file_type.size() + 8, 4));
  const std::string media_head = Mp4Box(
      "mdhd", version + std::string(8, '\0') + BigEndianBytes(1000, 4) + std::string(8, '\0'));
  return file_type + Mp4Box("mdat", data) +
         Mp4Box("moov", Mp4Box("trak", Mp4Box("mdia", media_head +
                                                          Mp4Box("minf", Mp4Box("stbl", tables)))));
}

inline std::string GpmfEntry(const std::string& key, char type, size_t bytes_each, size_t count,
                             std::string content) {
  const std::string head = key + type + BigEndianBytes(bytes_each, 1) + BigEndianBytes(count, 2);
  content.resize((content.size() + 3) / 4 * 4, '\0');
  return head + content;
}

/// A payload of a GoPro camera: `count` fixes that go north by 1e-5 degrees each.
inline std::string GpmfPayload(double latitude_deg, double longitude_deg, double altitude_m,
                               int count, uint32_t fix_kind = 3) {
  const auto number = [](double value, double scale) {
    return BigEndianBytes(static_cast<uint32_t>(static_cast<int32_t>(std::lround(value * scale))),
                          4);
  };
  std::string scales, records;
  for (uint64_t scale : {10000000, 10000000, 1000, 1000, 100}) scales += BigEndianBytes(scale, 4);
  for (int i = 0; i < count; ++i) {
    records += number(latitude_deg + 1e-5 * i, 1e7) + number(longitude_deg, 1e7) +
               number(altitude_m, 1e3) + number(0, 1) + number(0, 1);
  }
  const std::string stream = GpmfEntry("GPSF", 'L', 4, 1, BigEndianBytes(fix_kind, 4)) +
                             GpmfEntry("SCAL", 'l', 4, 5, scales) +
                             GpmfEntry("GPS5", 'l', 20, static_cast<size_t>(count), records);
  const std::string nested = GpmfEntry("STRM", '\0', 1, stream.size(), stream);
  return GpmfEntry("DEVC", '\0', 1, nested.size(), nested);
}

/// A payload of a GoPro camera's inertial sensor: rad/s and m/s^2.
inline std::string GpmfImuPayload(const std::vector<std::array<double, 3>>& turns,
                                  const std::vector<std::array<double, 3>>& forces) {
  const auto stream = [](const std::string& key, int scale,
                         const std::vector<std::array<double, 3>>& values) {
    std::string records;
    for (const auto& value : values) {
      for (const double axis : value) {
        records += BigEndianBytes(
            static_cast<uint16_t>(static_cast<int16_t>(std::lround(axis * scale))), 2);
      }
    }
    const std::string content =
        GpmfEntry("SCAL", 's', 2, 1, BigEndianBytes(static_cast<uint64_t>(scale), 2)) +
        GpmfEntry(key, 's', 6, values.size(), records);
    return GpmfEntry("STRM", '\0', 1, content.size(), content);
  };
  const std::string nested = stream("ACCL", 418, forces) + stream("GYRO", 3755, turns);
  return GpmfEntry("DEVC", '\0', 1, nested.size(), nested);
}

}  // namespace deepuav
