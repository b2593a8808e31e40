#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/base/error.h"

namespace deepuav {

/// A folder of the test's own, removed at its end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "deepuav_io_XXXXXX").string();
    if (!::mkdtemp(name.data())) throw Error("{}: cannot be created", name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Writes `text` to `name` below the folder, whose folders it makes.
  std::filesystem::path Write(const std::string& name, std::string_view text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::filesystem::remove(file);  // overwriting would wait for the disk
    std::ofstream(file, std::ios::binary)
        .write(text.data(), static_cast<std::streamsize>(text.size()));
    return file;
  }

 private:
  std::filesystem::path path_;
};

inline std::string ReadAll(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The message of the Error that `action` throws, which must be one line; fails the test where it
/// throws none.
inline std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
  ADD_FAILURE() << "no Error was thrown";
  return {};
}

/// The folder of real sequences, or nothing.
inline std::optional<std::filesystem::path> SharedFolder() {
  const char* named = std::getenv("DEEPUAV_SHARED");
  const std::filesystem::path folder = named ? named : DEEPUAV_SHARED_DEFAULT;
  if (!std::filesystem::is_directory(folder / "data")) return std::nullopt;
  return folder;
}

/// `text` with its only occurrence of `from` replaced: damages one field of a valid file.
inline std::string Replaced(std::string text, std::string_view from, std::string_view to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "no '" << from << "' to replace";
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// A JPEG or PNG (by `ending`) with a texture that depends on `seed`.
std::string EncodedImage(int width, int height, int seed, const std::string& ending = ".jpg");

/// What to put into a photograph's EXIF; what is empty or 0 is left out.
struct TestExif {
  std::string model, time, subsecond;
  int orientation = 0;
  double focal_length_mm = 0;
  int focal_length_35mm = 0;
  double focal_plane_x_px_per_inch = 0;
  int pixel_x_dimension = 0;
  std::optional<double> latitude_deg, longitude_deg, altitude_m;
  double more_longitude_seconds = 0;  ///< Beyond what an angle may have.
  std::string xmp = {};               ///< As a TIFF holds it.
};

/// A TIFF block (little endian) with that EXIF, its directory so many bytes from the start.
std::string ExifBlockBytes(const TestExif& exif, size_t directory_at = 8);
/// A JPEG with that EXIF.
std::string JpegPhotograph(int width, int height, int seed, const TestExif& exif);
/// A PNG with that EXIF.
std::string PngPhotograph(int width, int height, int seed, const TestExif& exif);

inline constexpr std::string_view kTestCameraYaml =
    "model: radial_tangential\n"
    "width: 64\n"
    "height: 48\n"
    "fx: 45.5\n"
    "fy: 46.5\n"
    "cx: 31.25\n"
    "cy: 24.75\n"
    "distortion: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n"
    "rate_hz: 20.0\n";

inline constexpr std::string_view kTestSensorYaml =
    "# General sensor definitions.\n"
    "sensor_type: camera\n"
    "comment: VI-Sensor cam0 (MT9M034)\n"
    "T_BS:\n"
    "  cols: 4\n"
    "  rows: 4\n"
    "  data: [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,\n"
    "         0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,\n"
    "        -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,\n"
    "         0.0, 0.0, 0.0, 1.0]\n"
    "rate_hz: 20\n"
    "resolution: [64, 48]\n"
    "camera_model: pinhole\n"
    "intrinsics: [45.5, 46.5, 31.25, 24.75] #fu, fv, cu, cv\n"
    "distortion_model: radial-tangential\n"
    "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n";

}  // namespace deepuav
