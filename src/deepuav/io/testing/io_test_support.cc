#include "deepuav/io/testing/io_test_support.h"

#include <cmath>
#include <opencv2/imgcodecs.hpp>

namespace deepuav {
namespace {

// EXIF 2.3, section 4.6: types of fields.
enum TiffType : uint16_t { kByte = 1, kAscii = 2, kShort = 3, kLong = 4, kRational = 5 };

template <typename Integer>
void Put(Integer value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

struct TiffField {
  uint16_t tag;
  TiffType type;
  uint32_t count;
  std::string bytes;
};

TiffField Text(uint16_t tag, const std::string& text) {
  return {tag, kAscii, static_cast<uint32_t>(text.size() + 1), text + '\0'};
}

TiffField Short(uint16_t tag, int value) {
  TiffField field{tag, kShort, 1, {}};
  Put(static_cast<uint16_t>(value), &field.bytes);
  return field;
}

TiffField Long(uint16_t tag, uint32_t value) {
  TiffField field{tag, kLong, 1, {}};
  Put(value, &field.bytes);
  return field;
}

TiffField Rationals(uint16_t tag, const std::vector<double>& values) {
  constexpr uint32_t kDenominator = 100000;
  TiffField field{tag, kRational, static_cast<uint32_t>(values.size()), {}};
  for (const double value : values) {
    Put(static_cast<uint32_t>(std::lround(value * kDenominator)), &field.bytes);
    Put(kDenominator, &field.bytes);
  }
  return field;
}

// One directory placed at `offset` of the block: its fields, the end mark, then the values that do
// not fit.
std::string Directory(const std::vector<TiffField>& fields, size_t offset) {
  std::string head, values;
  const size_t values_at = offset + 2 + 12 * fields.size() + 4;
  Put(static_cast<uint16_t>(fields.size()), &head);
  for (const TiffField& field : fields) {
    Put(field.tag, &head);
    Put(static_cast<uint16_t>(field.type), &head);
    Put(field.count, &head);
    if (field.bytes.size() <= 4) {
      head += field.bytes + std::string(4 - field.bytes.size(), '\0');
    } else {
      Put(static_cast<uint32_t>(values_at + values.size()), &head);
      values += field.bytes + std::string(field.bytes.size() % 2, '\0');
    }
  }
  Put(uint32_t{0}, &head);
  return head + values;
}

std::vector<double> DegreesMinutesSeconds(double angle) {
  const double degrees = std::floor(std::abs(angle));
  const double minutes = std::floor((std::abs(angle) - degrees) * 60);
  return {degrees, minutes, (std::abs(angle) - degrees - minutes / 60) * 3600};
}

std::vector<TiffField> CameraFields(const TestExif& exif) {
  std::vector<TiffField> fields;
  if (!exif.time.empty()) fields.push_back(Text(0x9003, exif.time));
  if (!exif.subsecond.empty()) fields.push_back(Text(0x9291, exif.subsecond));
  if (exif.focal_length_mm > 0) fields.push_back(Rationals(0x920a, {exif.focal_length_mm}));
  if (exif.pixel_x_dimension > 0) fields.push_back(Short(0xa002, exif.pixel_x_dimension));
  if (exif.focal_plane_x_px_per_inch > 0) {
    fields.push_back(Rationals(0xa20e, {exif.focal_plane_x_px_per_inch}));
    fields.push_back(Short(0xa210, 2));
  }
  if (exif.focal_length_35mm > 0) fields.push_back(Short(0xa405, exif.focal_length_35mm));
  return fields;
}

std::vector<TiffField> GpsFields(const TestExif& exif) {
  std::vector<TiffField> fields;
  if (exif.latitude_deg) {
    fields.push_back(Text(1, *exif.latitude_deg < 0 ? "S" : "N"));
    fields.push_back(Rationals(2, DegreesMinutesSeconds(*exif.latitude_deg)));
  }
  if (exif.longitude_deg) {
    fields.push_back(Text(3, *exif.longitude_deg < 0 ? "W" : "E"));
    std::vector<double> parts = DegreesMinutesSeconds(*exif.longitude_deg);
    parts.back() += exif.more_longitude_seconds;
    fields.push_back(Rationals(4, parts));
  }
  if (exif.altitude_m) {
    fields.push_back({5, kByte, 1, std::string(1, *exif.altitude_m < 0 ? '\1' : '\0')});
    fields.push_back(Rationals(6, {std::abs(*exif.altitude_m)}));
  }
  return fields;
}

}  // namespace

std::string ExifBlockBytes(const TestExif& exif, size_t directory_at) {
  std::vector<TiffField> fields;
  if (!exif.model.empty()) fields.push_back(Text(0x0110, exif.model));
  if (exif.orientation > 0) fields.push_back(Short(0x0112, exif.orientation));
  if (!exif.xmp.empty())
    fields.push_back({0x02bc, kByte, static_cast<uint32_t>(exif.xmp.size()), exif.xmp});
  fields.push_back(Long(0x8769, 0));
  fields.push_back(Long(0x8825, 0));
  const size_t camera_at = directory_at + Directory(fields, directory_at).size();
  const std::string camera = Directory(CameraFields(exif), camera_at);
  const size_t gps_at = camera_at + camera.size();
  fields[fields.size() - 2] = Long(0x8769, static_cast<uint32_t>(camera_at));
  fields[fields.size() - 1] = Long(0x8825, static_cast<uint32_t>(gps_at));
  std::string block = "II";
  Put(uint16_t{42}, &block);
  Put(static_cast<uint32_t>(directory_at), &block);
  block.resize(directory_at);
  return block + Directory(fields, directory_at) + camera + Directory(GpsFields(exif), gps_at);
}

std::string EncodedImage(int width, int height, int seed, const std::string& ending) {
  cv::Mat1b image(height, width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(y, x) = static_cast<uint8_t>(3 * x + 5 * y + 17 * seed);
  }
  std::vector<uint8_t> bytes;
  cv::imencode(ending, image, bytes);
  return {bytes.begin(), bytes.end()};
}

std::string JpegPhotograph(int width, int height, int seed, const TestExif& exif) {
  using namespace std::string_literals;
  const std::string payload = "Exif\0\0"s + ExifBlockBytes(exif);
  const size_t length = payload.size() + 2;
  const std::string head = {'\xff', '\xe1', static_cast<char>(length >> 8),
                            static_cast<char>(length & 0xff)};
  std::string jpeg = EncodedImage(width, height, seed);
  return jpeg.insert(2, head + payload);
}

std::string PngPhotograph(int width, int height, int seed, const TestExif& exif) {
  constexpr size_t kSignatureAndHeader = 8 + 25;
  const std::string block = ExifBlockBytes(exif);
  std::string chunk;
  for (int shift = 24; shift >= 0; shift -= 8)
    chunk += static_cast<char>(block.size() >> shift & 0xff);
  chunk += "eXIf" + block + std::string(4, '\0');
  return EncodedImage(width, height, seed, ".png").insert(kSignatureAndHeader, chunk);
}

}  // namespace deepuav
