#include "deepuav/io/cameras/tiff_metadata.h"

#include "deepuav/io/cameras/exif.h"
#include "deepuav/io/cameras/photo_head.h"
#include "deepuav/io/testing/io_test_support.h"
#include "support/fuzzing.h"

namespace deepuav {
namespace {

constexpr size_t kBehindPixels = size_t{700} << 10;

TestExif Multispectral() {
  TestExif exif;
  exif.model = "FC6360";
  exif.time = "2021:06:01 10:20:30";
  exif.focal_length_mm = 5.74;
  exif.latitude_deg = 47.25;
  exif.longitude_deg = 8.5;
  exif.xmp = "<x:xmpmeta drone-dji:CalibratedFocalLength=\"1913.3\"/>";
  return exif;
}

TEST(TiffMetadata, IsFoundBehindThePixels) {
  const TemporaryFolder folder;
  const auto file = folder.Write("a.tif", ExifBlockBytes(Multispectral(), kBehindPixels));
  const PhotoHead head(file);
  EXPECT_EQ(head.xmp(), Multispectral().xmp);
  const PhotoExif exif = ParseExif(head.exif());
  EXPECT_EQ(exif.camera_model, "FC6360");
  EXPECT_NEAR(exif.focal_length_mm.value_or(0), 5.74, 1e-6);
  ASSERT_TRUE(exif.fix && exif.time);
  EXPECT_NEAR(exif.fix->latitude_deg, 47.25, 1e-8);
  EXPECT_LT(head.exif().size(), size_t{64} << 10);
}

TEST(TiffMetadata, BytesMayBeInEitherOrder) {
  using namespace std::string_literals;
  const TemporaryFolder folder;
  // One field, the model's name, in the directory itself.
  const std::string tiff = "MM\0*\0\0\0\x08\0\x01\x01\x10\0\x02\0\0\0\x04X7S\0\0\0\0\0"s;
  const PhotoHead head(folder.Write("a.tif", tiff));
  EXPECT_EQ(ParseExif(head.exif()).camera_model, "X7S");
}

TEST(TiffMetadata, DirectoriesMaySayThatTheyAreSome) {
  std::string tiff = ExifBlockBytes(Multispectral(), kBehindPixels);
  for (const char* pointer : {"\x69\x87\x04", "\x25\x88\x04"})  // Of EXIF and GPS, a number.
    tiff[tiff.find(pointer) + 2] = 13;
  const TemporaryFolder folder;
  const PhotoExif exif = ParseExif(PhotoHead(folder.Write("a.tif", tiff)).exif());
  EXPECT_TRUE(exif.fix && exif.time);
}

TEST(TiffMetadata, OtherFilesHaveNone) {
  const TemporaryFolder folder;
  EXPECT_FALSE(ReadTiffMetadata(folder.Write("a.jpg", EncodedImage(32, 32, 1))));
  EXPECT_FALSE(ReadTiffMetadata(folder.Write("b.tif", "II*")));
  const auto cut = ExifBlockBytes(Multispectral(), kBehindPixels).substr(0, kBehindPixels);
  EXPECT_FALSE(ReadTiffMetadata(folder.Write("c.tif", cut)));
  EXPECT_NE(ErrorOf([] { PhotoHead("/nowhere/a.tif"); }).find("/nowhere/a.tif"), std::string::npos);
}

TEST(TiffMetadata, DamagedOnesAreReadAsFarAsTheyGo) {
  const TemporaryFolder folder;
  const std::vector<std::string> seeds = {ExifBlockBytes(Multispectral()),
                                          ExifBlockBytes(Multispectral(), 300)};
  Mutator mutator(&seeds);
  int64_t without_fix = 0;
  const FuzzCounts counts = FuzzInputs(3000, [&](int64_t) {
    const PhotoHead head(folder.Write("a.tif", mutator.Next()));
    without_fix += !ParseExif(head.exif()).fix;
  });
  EXPECT_EQ(counts.refused, 0);
  EXPECT_GT(without_fix, counts.inputs / 20);
}

}  // namespace
}  // namespace deepuav
