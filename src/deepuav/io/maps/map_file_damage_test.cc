#include "deepuav/io/testing/map_file_test_support.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

TEST_F(MapFileTest, EveryTruncationIsRefused) {
  const std::string bytes = SmallFile();
  for (size_t length = 0; length < bytes.size(); ++length) {
    ErrorOfBytes(bytes.substr(0, length));
    if (HasFailure()) FAIL() << "cut to " << length << " of " << bytes.size();
  }
  EXPECT_THAT(ErrorOfBytes(bytes + '\0'), HasSubstr("1 bytes follow the end"));
}

TEST_F(MapFileTest, EveryFlippedBitIsRefused) {
  std::string bytes = SmallFile();
  for (size_t at = 0; at < bytes.size(); ++at) {
    const char bit = static_cast<char>(1 << at % 8);
    bytes[at] = static_cast<char>(bytes[at] ^ bit);
    ErrorOfBytes(bytes);
    if (HasFailure()) FAIL() << "at byte " << at;
    bytes[at] = static_cast<char>(bytes[at] ^ bit);
  }
  EXPECT_NO_THROW(ReadBytesAsMap(bytes));
}

TEST_F(MapFileTest, ForeignAndNewerFilesAreNamed) {
  EXPECT_THAT(ErrorOfBytes("ply\nformat ascii 1.0\n"),
              HasSubstr("begins with 'ply\\x0aform': expected '\\x89UAVMAP\\x0a'"));
  std::string bytes = SmallFile();
  bytes[kMagic.size()] = kVersion + 1;
  EXPECT_THAT(ErrorOfBytes(bytes), HasSubstr("version 5, of a newer program: expected 2 to 4"));
  EXPECT_THAT(ErrorOf([&] { ReadMapFile(folder_.path()); }), HasSubstr("expected a file"));
  EXPECT_THAT(ErrorOf([&] { ReadMapFile(folder_.path() / "none.deepuav"); }),
              HasSubstr("none.deepuav"));
}

/// The content of a map section as version 2 had it: no model noise, no measurements.
TEST_F(MapFileTest, LyingImagesAreRefused) {
  std::vector<Section> sections = Sections(SmallFile());
  const auto image = std::find_if(sections.begin(), sections.end(), [](const Section& section) {
    return std::string_view(section.kind.data(), 4) == "IMAG" && section.content.size() > 100;
  });
  ASSERT_NE(image, sections.end());
  const std::string content = image->content;
  const auto with_number = [&](size_t at, uint32_t number) {
    image->content = content;
    std::memcpy(image->content.data() + at, &number, sizeof(number));
    return ErrorOf([&] { ReadSections(sections); });
  };
  EXPECT_THAT(with_number(0, 99), HasSubstr("image of keyframe 99: expected that of 1"));
  EXPECT_THAT(with_number(8, 17), HasSubstr("17 levels: expected at most 16"));
  EXPECT_THAT(with_number(8, 0), HasSubstr("too many"));
  EXPECT_THAT(with_number(12, 65), HasSubstr("is 65x48"));
  EXPECT_THAT(with_number(12, 0), HasSubstr("is 0x48"));
  image->content = content.substr(0, 20);
  EXPECT_THAT(ErrorOf([&] { ReadSections(sections); }), HasSubstr("in 0 bytes"));
  image->content = content;
  const uint32_t width = 48, height = 64;
  std::memcpy(image->content.data() + 12, &width, 4);
  std::memcpy(image->content.data() + 16, &height, 4);
  EXPECT_THAT(ErrorOf([&] { ReadSections(sections); }), HasSubstr("expected the camera's 64x48"));
}

TEST_F(MapFileTest, DamageIsCalledSo) {
  std::string bytes = SmallFile();
  bytes[bytes.size() / 2] ^= 1;
  EXPECT_THAT(ErrorOfBytes(bytes), testing::AnyOf(HasSubstr("damaged"), HasSubstr("truncated")));
}

TEST_F(MapFileTest, UncompressedSectionsAreRead) {
  const std::string bytes = SmallFile();
  ExpectSameAtlas(ReadSections(Sections(bytes)).atlas, ReadMapFile(file_).atlas);
}

TEST_F(MapFileTest, ABombIsRefused) {
  const std::string header = std::string(kMagic) + Bytes(kVersion);
  const std::string stored(100, 'x');
  const auto read = [&](uint32_t codec, uint64_t content_bytes) {
    return ErrorOfBytes(header + SealedSection({'A', 'T', 'L', 'S'}, codec, content_bytes, stored));
  };
  EXPECT_THAT(read(1, uint64_t{1} << 40), HasSubstr("at most 64 times"));
  EXPECT_THAT(read(1, 6401), testing::AnyOf(HasSubstr("at most 64 times"), HasSubstr("decomp")));
  EXPECT_THAT(read(1, 200), HasSubstr("cannot be decompressed to 200 bytes"));
  EXPECT_THAT(read(2, 100), HasSubstr("has codec 2"));
  EXPECT_THAT(read(0, 101), HasSubstr("has codec 0, 100 bytes for 101"));
}

/// What compresses beyond what a reader accepts is left as it is.
TEST_F(MapFileTest, SectionsOfOneByteRepeated) {
  const std::string zeros(1 << 20, '\0');
  SectionWriter writer(file_, kMagic, kVersion);
  writer.Write({'A', 'T', 'L', 'S'}, zeros);
  writer.Commit();
  SectionReader reader(file_, kMagic, kVersion, kVersion);
  EXPECT_EQ(reader.Read({'A', 'T', 'L', 'S'}), zeros);
  EXPECT_NO_THROW(reader.ExpectEnd());
}

/// Files whose checksums hold and whose content lies.
TEST_F(MapFileTest, LyingIdsAreRefused) {
  const std::vector<Section> sections = Sections(SmallFile());
  const auto with_number = [&](size_t section, size_t at, int64_t number) {
    std::vector<Section> changed = sections;
    std::memcpy(changed[section].content.data() + at, &number, sizeof(number));
    return ErrorOf([&] { ReadSections(changed); });
  };
  ASSERT_EQ(std::string_view(sections[1].kind.data(), 4), "MAP ");
  constexpr size_t kFirstKeyframe = 24, kKeyframeBytes = 104, kParent = 24, kRotation = 32;
  constexpr size_t kScale = 88, kLoops = 96;
  const size_t second = kFirstKeyframe + kKeyframeBytes;  // the first has no loop left
  EXPECT_THAT(with_number(1, 0, 7), HasSubstr("map 7: expected map 0"));
  EXPECT_THAT(with_number(1, 16, int64_t{1} << 60), HasSubstr("things follow"));
  const size_t fourth = second + 2 * kKeyframeBytes + 8;  // keyframe 4; the second closes a loop
  EXPECT_THAT(with_number(1, fourth, int64_t{1} << 60), HasSubstr("features of keyframe 4"));
  EXPECT_THAT(with_number(1, kFirstKeyframe, 2), HasSubstr("keyframe 0 has an image name"));
  EXPECT_THAT(with_number(1, kFirstKeyframe + kParent, 1), HasSubstr("own ancestor"));
  EXPECT_THAT(with_number(1, second + kParent, 99), HasSubstr("parent 99"));
  EXPECT_THAT(with_number(1, second + kRotation, 0), HasSubstr("keyframe 1 has no pose"));
  EXPECT_THAT(with_number(2, 0, 5), HasSubstr("features of keyframe 5: expected those of 0"));
  EXPECT_THAT(with_number(1, second + kScale, 0), HasSubstr("keyframe 1 has the scale 0"));
  EXPECT_THAT(with_number(1, second + kLoops, int64_t{1} << 60), HasSubstr("things follow"));
  EXPECT_THAT(with_number(1, second + kLoops + 8, 3), HasSubstr("closes a loop with 3"));
  // The image names end the map section: a length of 0 behind the last id.
  const size_t last_name = sections[1].content.size() - 16;
  EXPECT_THAT(with_number(1, last_name, 2), HasSubstr("keyframe 2 has an image name"));
  EXPECT_THAT(with_number(1, last_name, 1), HasSubstr("keyframe 1 has an image name"));
  EXPECT_THAT(with_number(1, last_name + 8, 1), HasSubstr("things follow"));
  // Three texts end the atlas section; before them the counters: ids, landmarks, maps.
  const MapOrigin origin = TestMapOrigin();
  const size_t end = sections[0].content.size() - 24 - origin.program.size() -
                     origin.features.size() - origin.matcher.size();
  EXPECT_THAT(with_number(0, end - 24, 3), HasSubstr("keyframe 3: expected fewer than the 3"));
  EXPECT_THAT(with_number(0, end - 24, int64_t{1} << 60), HasSubstr("keyframes were numbered"));
  EXPECT_THAT(with_number(0, end - 16, int64_t{1} << 60), HasSubstr("landmarks were numbered"));
  EXPECT_THAT(with_number(0, end - 8, 2), HasSubstr("is 'MAP '"));
  EXPECT_THAT(with_number(0, end - 8, int64_t{1} << 62), HasSubstr("is 'END '"));
}

/// An id for which a map would take far more memory than the file has bytes.
TEST_F(MapFileTest, HugeIdsAreRefused) {
  Atlas atlas;
  Map& map = atlas.Add(Map(atlas.NextMap()));
  const LandmarkId huge{int64_t{1} << 25};
  map.AddLandmark(huge, {1, 2, 3}, {});
  atlas.ids().landmarks = huge.value + 1;
  WriteAtlas(atlas);
  EXPECT_THAT(ErrorOf([&] { ReadMapFile(file_); }), HasSubstr("landmark 33554432: expected ids"));
}

}  // namespace
}  // namespace deepuav
