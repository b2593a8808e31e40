#include "deepuav/image/encoded_size.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/image/image.h"

namespace deepuav {
namespace {

std::vector<uint8_t> Encode(const std::string& ending, const cv::Size& size,
                            const std::vector<int>& parameters = {}) {
  std::vector<uint8_t> bytes;
  cv::imencode(ending, cv::Mat1b(size, 100), bytes, parameters);
  return bytes;
}

TEST(EncodedSize, IsThatOfTheDecodedImage) {
  const cv::Size2d expected(70, 31);
  for (const std::string ending : {".jpg", ".png", ".tif", ".bmp", ".webp"}) {
    const auto size = EncodedSize(Encode(ending, {70, 31}));
    ASSERT_TRUE(size) << ending;
    EXPECT_EQ(*size, expected) << ending;
  }
  EXPECT_EQ(EncodedSize(Encode(".jpg", {70, 31}, {cv::IMWRITE_JPEG_PROGRESSIVE, 1})), expected);
}

TEST(EncodedSize, OfOtherBytesIsNothing) {
  EXPECT_FALSE(EncodedSize({}));
  EXPECT_FALSE(EncodedSize(Encode(".pgm", {70, 31})));
  const std::vector<uint8_t> jpeg = Encode(".jpg", {70, 31});
  EXPECT_FALSE(EncodedSize({jpeg.data(), 20}));
}

TEST(EncodedSize, AnImageTooLargeToHoldIsRefusedBeforeItIsDecoded) {
  std::vector<uint8_t> png = Encode(".png", {70, 31});
  png[16] = png[20] = 0x40;  // the top bytes of width and height
  try {
    DecodeGrey(png, "huge.png");
    ADD_FAILURE() << "no Error was thrown";
  } catch (const Error& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("image huge.png: is 1073741894x1073741855"))
        << error.what();
  }
}

}  // namespace
}  // namespace deepuav
