#include "deepuav/io/cameras/exif.h"

#include <libexif/exif-data.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

namespace deepuav {
namespace {

constexpr double kFullFrameWidthMm = 36, kFullFrameDiagonalMm = 43.2666;
constexpr double kFullFrameAspect = 1.5;
constexpr double kMmPerInch = 25.4;

// Sensor widths of cameras that drones carry, for photographs that give only the focal length in
// mm.
struct KnownSensor {
  std::string_view model;
  double width_mm;
};
constexpr double kWidthOfOneByTwoPointThreeInch = 6.17;
constexpr double kWidthOfOneInch = 13.2;
constexpr double kWidthOfFourThirds = 17.3;
constexpr KnownSensor kKnownSensors[] = {
    {"FC300C", kWidthOfOneByTwoPointThreeInch},   // Phantom 3 Standard
    {"FC300S", kWidthOfOneByTwoPointThreeInch},   // Phantom 3 Advanced
    {"FC300SE", kWidthOfOneByTwoPointThreeInch},  // Phantom 3 SE
    {"FC300X", kWidthOfOneByTwoPointThreeInch},   // Phantom 3 Professional
    {"FC300XW", kWidthOfOneByTwoPointThreeInch},  // Phantom 3 4K
    {"FC330", kWidthOfOneByTwoPointThreeInch},    // Phantom 4
    {"FC350", kWidthOfOneByTwoPointThreeInch},    // Inspire 1, X3
    {"FC220", kWidthOfOneByTwoPointThreeInch},    // Mavic Pro
    {"FC1102", kWidthOfOneByTwoPointThreeInch},   // Spark
    {"FC2103", kWidthOfOneByTwoPointThreeInch},   // Mavic Air
    {"FC2204", kWidthOfOneByTwoPointThreeInch},   // Mavic 2 Zoom
    {"FC7203", kWidthOfOneByTwoPointThreeInch},   // Mavic Mini
    {"FC7303", kWidthOfOneByTwoPointThreeInch},   // Mini 2
    {"FC6310", kWidthOfOneInch},                  // Phantom 4 Pro
    {"FC6310S", kWidthOfOneInch},                 // Phantom 4 Pro V2
    {"FC6310R", kWidthOfOneInch},                 // Phantom 4 RTK
    {"FC6510", kWidthOfOneInch},                  // Zenmuse X4S
    {"L1D-20c", kWidthOfOneInch},                 // Mavic 2 Pro
    {"FC3411", kWidthOfOneInch},                  // Air 2S
    {"FC550", kWidthOfFourThirds},                // Zenmuse X5
    {"FC550RAW", kWidthOfFourThirds},             // Zenmuse X5R
    {"FC6520", kWidthOfFourThirds},               // Zenmuse X5S
    {"L2D-20c", kWidthOfFourThirds},              // Mavic 3
};

/// One parsed EXIF block.
class ExifBlock {
 public:
  explicit ExifBlock(std::span<const uint8_t> bytes)
      : data_(exif_data_new_from_data(bytes.data(), static_cast<unsigned int>(bytes.size())),
              &exif_data_unref) {
    if (data_) order_ = exif_data_get_byte_order(data_.get());
  }

  // Of the tag's own format and at least `count` components that lie within its bytes; else null.
  const ExifEntry* Find(ExifIfd ifd, int tag, ExifFormat format, size_t count) const {
    if (!data_ || !data_->ifd[ifd]) return nullptr;
    const ExifEntry* entry = exif_content_get_entry(data_->ifd[ifd], static_cast<ExifTag>(tag));
    if (!entry || !entry->data || entry->format != format || entry->components < count)
      return nullptr;
    return entry->size >= count * exif_format_get_size(format) ? entry : nullptr;
  }

  std::string Text(ExifIfd ifd, int tag) const {
    const ExifEntry* entry = Find(ifd, tag, EXIF_FORMAT_ASCII, 1);
    if (!entry) return {};
    const char* begin = reinterpret_cast<const char*>(entry->data);
    std::string text(begin, strnlen(begin, entry->size));
    text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }

  std::optional<double> Ratio(ExifIfd ifd, int tag, size_t index = 0) const {
    const ExifEntry* entry = Find(ifd, tag, EXIF_FORMAT_RATIONAL, index + 1);
    if (!entry) return std::nullopt;
    const ExifRational ratio = exif_get_rational(entry->data + index * 8, order_);
    if (ratio.denominator == 0) return std::nullopt;
    return static_cast<double>(ratio.numerator) / ratio.denominator;
  }

  std::optional<double> Whole(ExifIfd ifd, int tag) const {
    if (const ExifEntry* entry = Find(ifd, tag, EXIF_FORMAT_SHORT, 1)) {
      return exif_get_short(entry->data, order_);
    }
    if (const ExifEntry* entry = Find(ifd, tag, EXIF_FORMAT_LONG, 1))
      return exif_get_long(entry->data, order_);
    return std::nullopt;
  }

  std::optional<int> Byte(ExifIfd ifd, int tag) const {
    const ExifEntry* entry = Find(ifd, tag, EXIF_FORMAT_BYTE, 1);
    return entry ? std::optional<int>(entry->data[0]) : std::nullopt;
  }

 private:
  std::unique_ptr<ExifData, void (*)(ExifData*)> data_;
  ExifByteOrder order_ = EXIF_BYTE_ORDER_INTEL;
};

// Nothing unless the value is more than zero.
std::optional<double> Positive(std::optional<double> value) {
  return value && *value > 0 && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int> ParseDigits(std::string_view text) {
  int number = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (status != std::errc() || end != text.data() + text.size() || number < 0) return std::nullopt;
  return number;
}

// "YYYY:MM:DD HH:MM:SS" and the decimals of the second.
std::optional<Timestamp> ParseTime(const std::string& text, const std::string& decimals) {
  if (text.size() != 19) return std::nullopt;
  const std::string_view view = text;
  std::array<int, 6> parts{};
  constexpr std::array<size_t, 6> kStarts = {0, 5, 8, 11, 14, 17};
  for (size_t i = 0; i < parts.size(); ++i) {
    const std::optional<int> part = ParseDigits(view.substr(kStarts[i], i == 0 ? 4 : 2));
    if (!part) return std::nullopt;
    parts[i] = *part;
  }
  const std::chrono::year_month_day day{std::chrono::year{parts[0]},
                                        std::chrono::month{static_cast<unsigned>(parts[1])},
                                        std::chrono::day{static_cast<unsigned>(parts[2])}};
  constexpr int kFirstYear = 1971,
                kLastYear = 2200;  // a clock never set reads 1970 or 0; int64 ns end in 2262
  if (!day.ok() || parts[0] < kFirstYear || parts[0] > kLastYear || parts[3] > 23 ||
      parts[4] > 59 || parts[5] > 60) {
    return std::nullopt;
  }
  const int64_t days = std::chrono::sys_days(day).time_since_epoch().count();
  const int64_t seconds = ((days * 24 + parts[3]) * 60 + parts[4]) * 60 + parts[5];
  int64_t nanoseconds = 0;
  const std::string padded = (decimals + "000000000").substr(0, 9);
  if (const std::optional<int> fraction = ParseDigits(padded)) nanoseconds = *fraction;
  return Timestamp{seconds * 1000000000 + nanoseconds};
}

constexpr int kHorizontalPositioningError = 0x001F;  // GPSHPositioningError, in metres.
constexpr double kMostMinutes = 60;                  // And seconds: some round up to it.

// Degrees, minutes and seconds, negative where the reference letter is `negative_ref`.
std::optional<double> ReadAngleDeg(const ExifBlock& exif, int tag, int ref_tag, char negative_ref) {
  double angle = 0, unit = 1;
  for (size_t i = 0; i < 3; ++i, unit /= 60) {
    const std::optional<double> part = exif.Ratio(EXIF_IFD_GPS, tag, i);
    if (!part && i == 0) return std::nullopt;
    if (i > 0 && std::abs(part.value_or(0)) > kMostMinutes) return std::nullopt;
    angle += part.value_or(0) * unit;
  }
  const std::string reference = exif.Text(EXIF_IFD_GPS, ref_tag);
  if (reference.empty()) return std::nullopt;
  return reference[0] == negative_ref ? -angle : angle;
}

std::optional<GnssFix> ReadFix(const ExifBlock& exif) {
  const auto latitude = ReadAngleDeg(exif, EXIF_TAG_GPS_LATITUDE, EXIF_TAG_GPS_LATITUDE_REF, 'S');
  const auto longitude =
      ReadAngleDeg(exif, EXIF_TAG_GPS_LONGITUDE, EXIF_TAG_GPS_LONGITUDE_REF, 'W');
  if (!latitude || !longitude) return std::nullopt;
  GnssFix fix;
  fix.latitude_deg = *latitude;
  fix.longitude_deg = *longitude;
  if (!IsPlaceOnEarth(fix)) return std::nullopt;
  fix.altitude_m = exif.Ratio(EXIF_IFD_GPS, EXIF_TAG_GPS_ALTITUDE);
  const bool below_sea_level = exif.Byte(EXIF_IFD_GPS, EXIF_TAG_GPS_ALTITUDE_REF) == 1;
  if (fix.altitude_m && below_sea_level) fix.altitude_m = -*fix.altitude_m;
  const double sigma_m =
      Positive(exif.Ratio(EXIF_IFD_GPS, kHorizontalPositioningError)).value_or(0);
  fix.sigma_m = {sigma_m, sigma_m, 0};
  return fix;
}

std::optional<double> ReadSensorWidthMm(const ExifBlock& exif) {
  const auto density = Positive(exif.Ratio(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_X_RESOLUTION));
  auto pixels = Positive(exif.Whole(EXIF_IFD_EXIF, EXIF_TAG_PIXEL_X_DIMENSION));
  if (!pixels) pixels = Positive(exif.Whole(EXIF_IFD_0, EXIF_TAG_IMAGE_WIDTH));
  if (!density || !pixels) return std::nullopt;
  const double unit = exif.Whole(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT).value_or(2);
  const double unit_mm = unit == 3 ? 10 : unit == 4 ? 1 : kMmPerInch;
  return *pixels / *density * unit_mm;
}

// EXIF of a PNG lies in a chunk of its own, without the mark that libexif looks for.
std::vector<uint8_t> ExifChunkOfPng(std::span<const uint8_t> bytes) {
  constexpr size_t kSignatureBytes = 8, kChunkFrameBytes = 12;
  const auto big_endian = [&](size_t at) {
    return size_t{bytes[at]} << 24 | size_t{bytes[at + 1]} << 16 | size_t{bytes[at + 2]} << 8 |
           bytes[at + 3];
  };
  for (size_t at = kSignatureBytes; at + kChunkFrameBytes <= bytes.size();) {
    const size_t length = big_endian(at);
    if (length > bytes.size() - at - kChunkFrameBytes) break;
    if (std::memcmp(&bytes[at + 4], "eXIf", 4) == 0) {
      return {bytes.begin() + static_cast<ptrdiff_t>(at + 8),
              bytes.begin() + static_cast<ptrdiff_t>(at + 8 + length)};
    }
    at += length + kChunkFrameBytes;
  }
  return {};
}

bool StartsWith(std::span<const uint8_t> bytes, std::string_view mark) {
  return bytes.size() >= mark.size() && std::memcmp(bytes.data(), mark.data(), mark.size()) == 0;
}

// What libexif understands: a JPEG as it is, a bare TIFF block behind its mark.
std::vector<uint8_t> ForLibexif(std::span<const uint8_t> bytes) {
  using namespace std::string_view_literals;
  std::vector<uint8_t> block;
  if (StartsWith(bytes, "\x89PNG")) {
    block = ExifChunkOfPng(bytes);
  } else if (StartsWith(bytes, "II*\0"sv) || StartsWith(bytes, "MM\0*"sv)) {
    block.assign(bytes.begin(), bytes.end());
  } else {
    return {bytes.begin(), bytes.end()};
  }
  constexpr std::array<uint8_t, 6> kMark = {'E', 'x', 'i', 'f', 0, 0};
  block.insert(block.begin(), kMark.begin(), kMark.end());
  return block;
}

}  // namespace

bool IsPlaceOnEarth(const GnssFix& fix) {
  constexpr double kMinute_deg = 1.0 / 60;
  const double latitude_deg = std::abs(fix.latitude_deg);
  const double longitude_deg = std::abs(fix.longitude_deg);
  return latitude_deg <= 90 && longitude_deg <= 180 &&
         (latitude_deg >= kMinute_deg || longitude_deg >= kMinute_deg);
}

PhotoExif ParseExif(std::span<const uint8_t> bytes) {
  const ExifBlock block(ForLibexif(bytes));
  PhotoExif exif;
  exif.time = ParseTime(block.Text(EXIF_IFD_EXIF, EXIF_TAG_DATE_TIME_ORIGINAL),
                        block.Text(EXIF_IFD_EXIF, EXIF_TAG_SUB_SEC_TIME_ORIGINAL));
  exif.fix = ReadFix(block);
  exif.camera_model = block.Text(EXIF_IFD_0, EXIF_TAG_MODEL);
  exif.focal_length_mm = Positive(block.Ratio(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH));
  exif.focal_length_35mm = Positive(block.Whole(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM));
  exif.is_turned = block.Whole(EXIF_IFD_0, EXIF_TAG_ORIENTATION).value_or(1) != 1;
  exif.sensor_width_mm = ReadSensorWidthMm(block);
  return exif;
}

std::optional<double> FocalLengthPx(const PhotoExif& exif, int width_px, int height_px) {
  const double long_side_px = std::max(width_px, height_px);
  const double short_side_px = std::min(width_px, height_px);
  if (exif.focal_length_35mm) {
    const double px_per_mm = long_side_px < kFullFrameAspect * short_side_px
                                 ? std::hypot(width_px, height_px) / kFullFrameDiagonalMm
                                 : long_side_px / kFullFrameWidthMm;
    return *exif.focal_length_35mm * px_per_mm;
  }
  if (!exif.focal_length_mm) return std::nullopt;
  if (exif.sensor_width_mm) return *exif.focal_length_mm / *exif.sensor_width_mm * long_side_px;
  const auto known =
      std::find_if(std::begin(kKnownSensors), std::end(kKnownSensors),
                   [&](const KnownSensor& sensor) { return sensor.model == exif.camera_model; });
  if (known == std::end(kKnownSensors)) return std::nullopt;
  return *exif.focal_length_mm / known->width_mm * long_side_px;
}

}  // namespace deepuav
