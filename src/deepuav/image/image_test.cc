#include "deepuav/image/image.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "deepuav/base/error.h"
#include "deepuav/image/reduced_image.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Bytes = std::vector<uint8_t>;

// A picture without symmetry, so that a turned one differs.
GreyImage Picture() {
  GreyImage image(48, 64);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image(y, x) = static_cast<uint8_t>(2 * x + y + (x > 40 && y < 10 ? 60 : 0));
    }
  }
  return image;
}

Bytes Encode(const char* extension, const cv::Mat& image, const std::vector<int>& parameters = {}) {
  Bytes bytes;
  cv::imencode(extension, image, bytes, parameters);
  return bytes;
}

void Append(Bytes* bytes, const Bytes& more) {
  bytes->insert(bytes->end(), more.begin(), more.end());
}

Bytes Concatenate(const Bytes& a, const Bytes& b) {
  Bytes both = a;
  Append(&both, b);
  return both;
}

// The JPEG with a segment (marker, payload) inserted after the start of the image.
Bytes InsertSegment(const Bytes& jpeg, uint8_t marker, const Bytes& payload) {
  const size_t length = payload.size() + 2;
  Bytes bytes(jpeg.begin(), jpeg.begin() + 2);
  Append(&bytes, {0xff, marker, static_cast<uint8_t>(length >> 8), static_cast<uint8_t>(length)});
  Append(&bytes, payload);
  bytes.insert(bytes.end(), jpeg.begin() + 2, jpeg.end());
  return bytes;
}

Bytes ExifWithOrientation(uint8_t orientation) {
  return {'E', 'x', 'i', 'f', 0, 0, 'M', 'M', 0, 42, 0, 0,           0, 8,  // header
          0,   1,   1,   18,  0, 3, 0,   0,   0, 1,  0, orientation, 0, 0,  // one entry, 0x0112
          0,   0,   0,   0};
}

double MaxDifference(const cv::Mat& a, const cv::Mat& b) {
  EXPECT_EQ(a.size(), b.size());
  return a.size() == b.size() ? cv::norm(a, b, cv::NORM_INF) : 255;
}

void ExpectRefused(const Bytes& bytes, const std::string& reason) {
  EXPECT_THAT([&] { DecodeGrey(bytes, "left.jpg"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("left.jpg"), HasSubstr(reason))))
      << bytes.size();
}

TEST(DecodeGrey, DecodesWholeImages) {
  const GreyImage picture = Picture();
  for (const char* extension : {".png", ".pgm", ".bmp"}) {
    EXPECT_EQ(MaxDifference(DecodeGrey(Encode(extension, picture), "a"), picture), 0) << extension;
  }
  EXPECT_LE(MaxDifference(DecodeGrey(Encode(".jpg", picture), "a"), picture), 12);
}

TEST(DecodeGrey, DecodesEveryKindOfJpeg) {
  const GreyImage picture = Picture();
  for (const std::vector<int>& parameters : {std::vector<int>{cv::IMWRITE_JPEG_PROGRESSIVE, 1},
                                             {cv::IMWRITE_JPEG_RST_INTERVAL, 2},
                                             {cv::IMWRITE_JPEG_OPTIMIZE, 1},
                                             {cv::IMWRITE_JPEG_QUALITY, 100}}) {
    EXPECT_LE(MaxDifference(DecodeGrey(Encode(".jpg", picture, parameters), "a"), picture), 12);
  }
}

Bytes CutTo(const Bytes& whole, double share) {
  return {whole.begin(),
          whole.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(whole.size()))};
}

TEST(DecodeGrey, RefusesTruncatedProgressiveJpegsAtEveryLength) {
  const Bytes whole = Encode(".jpg", Picture(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  for (size_t length = 1; length < whole.size(); ++length) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    ASSERT_THROW(DecodeGrey(cut, "a"), Error) << length << " of " << whole.size();
  }
}

// Every row of blocks takes about as many bytes as any other.
GreyImage Noise() {
  GreyImage noise(256, 320);
  cv::RNG random(5);
  random.fill(noise, cv::RNG::UNIFORM, 0, 255);
  return noise;
}

TEST(DecodeGrey, UsesAJpegThatBreaksOffNearItsEndAsFarAsItGoes) {
  const Bytes whole = Encode(".jpg", Noise());
  const GreyImage expected = DecodeGrey(whole, "a");
  for (const double share : {0.8, 0.9, 0.97}) {
    const GreyImage cut = DecodeGrey(CutTo(whole, share), "a");
    ASSERT_EQ(cut.size(), expected.size());
    const cv::Range good(0, static_cast<int>((share - 0.06) * expected.rows));
    EXPECT_EQ(MaxDifference(cut.rowRange(good), expected.rowRange(good)), 0) << share;
  }
  for (const double share : {0.02, 0.3, 0.6, 0.7}) ExpectRefused(CutTo(whole, share), "breaks off");
}

TEST(DecodeReducedGrey, HasTheSizeAskedForAndTheSamePicture) {
  GreyImage smooth;
  cv::GaussianBlur(Noise(), smooth, {}, 6);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  for (const char* extension : {".jpg", ".png", ".webp", ".bmp", ".tif"}) {
    const Bytes bytes = Encode(extension, smooth);
    for (const cv::Size size : {cv::Size(160, 128), cv::Size(100, 80), cv::Size(61, 40)}) {
      GreyImage expected;
      cv::resize(DecodeGrey(bytes, "a"), expected, size, 0, 0, cv::INTER_AREA);
      EXPECT_LE(MaxDifference(DecodeReducedGrey(bytes, "a", size), expected), 8)
          << extension << size;
    }
  }
}

TEST(DecodeGrey, StretchesThermalImages) {
  const GreyImage picture = Picture();
  cv::Mat counts, kelvin;
  picture.convertTo(counts, CV_16U, 3, 7000);
  picture.convertTo(kelvin, CV_32F, 0.05, 280);
  for (const Bytes& bytes : {Encode(".png", counts), Encode(".tif", kelvin)}) {
    const GreyImage grey = DecodeGrey(bytes, "a");
    double least = 0, most = 0;
    cv::minMaxLoc(grey, &least, &most);
    EXPECT_EQ(least, 0);
    EXPECT_EQ(most, 255);
    EXPECT_LT(grey(5, 5), grey(40, 30));
  }
}

void ExpectCutsRefused(const char* extension, size_t step) {
  const Bytes whole = Encode(extension, Picture());
  for (size_t length = 1; length < whole.size(); length += step) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    ASSERT_THROW(DecodeGrey(cut, "a"), Error)
        << extension << " " << length << " of " << whole.size();
  }
}

TEST(DecodeGrey, RefusesTruncatedFilesOfOtherFormats) {
  ExpectCutsRefused(".png", 1);
  // OpenCV itself refuses these, with a message for each.
  ExpectCutsRefused(".pgm", 700);
  ExpectCutsRefused(".bmp", 700);
}

TEST(DecodeGrey, RefusesAFileWhoseTailWasNeverWritten) {
  for (const char* extension : {".jpg", ".png"}) {
    Bytes bytes = Encode(extension, Picture());
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2), bytes.end(), 0);
    ExpectRefused(bytes, "expected a whole image");
  }
}

TEST(DecodeGrey, AcceptsBytesAfterTheEnd) {
  const Bytes jpeg = Encode(".jpg", Picture());
  const GreyImage expected = DecodeGrey(jpeg, "a");
  EXPECT_EQ(MaxDifference(DecodeGrey(Concatenate(jpeg, Bytes(1000, 7)), "a"), expected), 0);
  EXPECT_EQ(MaxDifference(DecodeGrey(Concatenate(jpeg, Encode(".jpg", Picture())), "a"), expected),
            0);
}

TEST(DecodeGrey, LooksPastTheEndMarkerOfAThumbnail) {
  const Bytes thumbnail = Encode(".jpg", GreyImage(8, 8, uint8_t{9}));
  const Bytes whole = InsertSegment(Encode(".jpg", Picture()), 0xe1, thumbnail);
  EXPECT_EQ(DecodeGrey(whole, "a").cols, 64);
  const size_t end_of_thumbnail = 6 + thumbnail.size();
  const Bytes without_end(whole.begin(), whole.end() - 2);
  EXPECT_EQ(MaxDifference(DecodeGrey(without_end, "a"), DecodeGrey(whole, "a")), 0);
  for (const size_t length : {end_of_thumbnail, end_of_thumbnail + 40}) {
    ExpectRefused(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)),
                  "breaks off");
  }
}

TEST(DecodeGrey, IgnoresTheExifOrientation) {
  const Bytes upright = Encode(".jpg", Picture());
  const Bytes turned = InsertSegment(upright, 0xe1, ExifWithOrientation(6));
  cv::Mat turned_by_opencv = cv::imdecode(turned, cv::IMREAD_GRAYSCALE);
  ASSERT_EQ(turned_by_opencv.rows, 64) << "the test's EXIF data is not understood";
  EXPECT_EQ(MaxDifference(DecodeGrey(turned, "a"), DecodeGrey(upright, "a")), 0);
}

TEST(DecodeGrey, ConvertsSixteenBitsAndColour) {
  const GreyImage picture = Picture();
  cv::Mat deep, colour, transparent;
  picture.convertTo(deep, CV_16U, 257);
  EXPECT_LE(MaxDifference(DecodeGrey(Encode(".png", deep), "a"), picture), 1);
  cv::cvtColor(picture, colour, cv::COLOR_GRAY2BGR);
  EXPECT_LE(MaxDifference(DecodeGrey(Encode(".png", colour), "a"), picture), 1);
  cv::cvtColor(picture, transparent, cv::COLOR_GRAY2BGRA);
  EXPECT_LE(MaxDifference(DecodeGrey(Encode(".png", transparent), "a"), picture), 1);

  const cv::Mat3b red(4, 4, cv::Vec3b(0, 0, 200));
  EXPECT_NEAR(DecodeGrey(Encode(".png", red), "a")(0, 0), 0.299 * 200, 1);
}

TEST(DecodeGrey, RefusesWhatIsNoImage) {
  ExpectRefused({}, "empty");
  ExpectRefused(Bytes(5000, 0), "cannot be decoded");
  ExpectRefused({'h', 'e', 'l', 'l', 'o'}, "cannot be decoded");
}

class LoadGreyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("deepuav_image_test_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const Bytes& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return folder_ / name;
  }

  std::filesystem::path folder_;
};

TEST_F(LoadGreyTest, ReadsAFile) {
  EXPECT_EQ(MaxDifference(LoadGrey(Write("a.png", Encode(".png", Picture()))), Picture()), 0);
}

TEST_F(LoadGreyTest, NamesTheBadFile) {
  const auto expect_refused = [](const std::filesystem::path& file, const char* reason) {
    EXPECT_THAT([&] { LoadGrey(file); },
                ThrowsMessage<Error>(AllOf(HasSubstr(file.string()), HasSubstr(reason))));
  };
  expect_refused(folder_ / "absent.png", "cannot be opened");
  expect_refused(folder_, "cannot be opened");
  expect_refused(Write("empty.jpg", {}), "empty");
  Bytes cut = Encode(".jpg", Picture());
  cut.resize(cut.size() / 2);  // half of the rows at most
  expect_refused(Write("cut.jpg", cut), "breaks off");
}

TEST_F(LoadGreyTest, ColoursStayAndLostRowsAreCutOff) {
  cv::Mat3b picture(480, 640);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x)
      picture(y, x) = cv::Vec3b(200, static_cast<uchar>(y / 4), static_cast<uchar>(x / 4));
  }
  Bytes jpeg = Encode(".jpg", picture);
  const cv::Mat3b whole = LoadReducedColour(Write("whole.jpg", jpeg), {160, 120});
  ASSERT_EQ(whole.size(), cv::Size(160, 120));
  EXPECT_NEAR(whole(60, 80)[0], 200, 4);
  EXPECT_NEAR(whole(60, 80)[1], 60, 4);
  EXPECT_NEAR(whole(60, 80)[2], 80, 4);
  jpeg.resize(jpeg.size() * 9 / 10);
  const cv::Mat3b broken = LoadReducedColour(Write("broken.jpg", jpeg), {160, 120});
  EXPECT_EQ(broken.cols, 160);
  EXPECT_GT(broken.rows, 90);
  EXPECT_LT(broken.rows, 120);
  EXPECT_NEAR(broken(broken.rows - 2, 80)[0], 200, 4);
  const cv::Mat3b grey = LoadReducedColour(Write("grey.png", Encode(".png", Picture())), {});
  EXPECT_EQ(grey(3, 5), cv::Vec3b::all(Picture()(3, 5)));
  EXPECT_THROW(LoadReducedColour(Write("none.jpg", {1, 2, 3}), {}), Error);
}

}  // namespace
}  // namespace deepuav
