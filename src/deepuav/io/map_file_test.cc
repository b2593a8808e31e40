#include "deepuav/io/map_file.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "deepuav/base/random.h"
#include "deepuav/base/sha256.h"
#include "deepuav/base/time.h"
#include "deepuav/io/section_file.h"
#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/io/testing/map_test_support.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

constexpr std::string_view kMagic = "\x89UAVMAP\n";
constexpr uint32_t kVersion = 3;
constexpr size_t kHeaderBytes = 12, kHeadBytes = 24, kDigestBytes = 32;

struct Section {
  SectionKind kind;
  std::string content;
};

template <typename Number>
std::string Bytes(Number number) {
  return {reinterpret_cast<const char*>(&number), sizeof(number)};
}

/// One section as docs/map-format.md states it.
std::string SealedSection(const SectionKind& kind, uint32_t codec, uint64_t content_bytes,
                          const std::string& stored) {
  std::string bytes(kind.data(), kind.size());
  bytes += Bytes(codec) + Bytes(content_bytes) + Bytes(uint64_t{stored.size()}) + stored;
  const std::string hex = Sha256(bytes);
  for (size_t i = 0; i < hex.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  }
  return bytes;
}

/// A file of the sections whose checksums hold.
std::string Sealed(const std::vector<Section>& sections) {
  std::string bytes = std::string(kMagic) + Bytes(kVersion);
  for (const Section& section : sections) {
    bytes += SealedSection(section.kind, 0, section.content.size(), section.content);
  }
  return bytes + SealedSection({'E', 'N', 'D', ' '}, 0, 0, "");
}

class MapFileTest : public ::testing::Test {
 protected:
  std::string WriteAtlas(const Atlas& atlas) {
    WriteMapFile(file_, atlas, TestMapCamera(), TestMapOrigin());
    return ReadAll(file_);
  }
  std::string SmallFile() { return WriteAtlas(TestAtlas(7, 6, 4, 1)); }

  LoadedAtlas ReadBytesAsMap(const std::string& bytes) {
    return ReadMapFile(folder_.Write("damaged.deepuav", bytes));
  }
  std::string ErrorOfBytes(const std::string& bytes) {
    const std::string message = ErrorOf([&] { ReadBytesAsMap(bytes); });
    EXPECT_THAT(message, HasSubstr("damaged.deepuav: "));
    return message;
  }

  /// The sections of the file, without the end.
  std::vector<Section> Sections(const std::string& bytes) {
    std::vector<Section> sections;
    SectionReader reader(folder_.Write("whole.deepuav", bytes), kMagic, kVersion, kVersion);
    for (size_t at = kHeaderBytes;;) {
      SectionKind kind;
      std::copy_n(bytes.begin() + static_cast<ptrdiff_t>(at), kind.size(), kind.begin());
      if (std::string_view(kind.data(), kind.size()) == "END ") return sections;
      sections.push_back({kind, std::string(reader.Read(kind))});
      uint64_t stored_bytes;
      std::memcpy(&stored_bytes, bytes.data() + at + 16, sizeof(stored_bytes));
      at += kHeadBytes + stored_bytes + kDigestBytes;
    }
  }
  LoadedAtlas ReadSections(const std::vector<Section>& sections) {
    return ReadBytesAsMap(Sealed(sections));
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "map.deepuav";
};

TEST_F(MapFileTest, ReloadsToTheBit) {
  const Atlas atlas = TestAtlas(20, 30, 64, 1);
  const Map& map = atlas.At(MapId{0});
  ASSERT_EQ(map.culled().size(), 2u);
  ASSERT_EQ(map.merged_into().size(), 2u);
  ASSERT_GT(map.LandmarkCount(), 50);
  WriteAtlas(atlas);
  const LoadedAtlas loaded = ReadMapFile(file_);
  ExpectSameAtlas(atlas, loaded.atlas);
  const Camera expected = TestMapCamera();
  EXPECT_EQ(loaded.camera.width, expected.width);
  EXPECT_EQ(loaded.camera.height, expected.height);
  EXPECT_EQ(loaded.camera.pinhole.Matrix(), expected.pinhole.Matrix());
  EXPECT_EQ(loaded.camera.lens, expected.lens);
  EXPECT_EQ(loaded.camera.distortion, expected.distortion);
  EXPECT_EQ(loaded.camera.rate_hz, expected.rate_hz);
}

TEST_F(MapFileTest, KeepsScalesAndLoops) {
  const Atlas atlas = TestAtlas(20, 30, 64, 1);
  const Map& map = atlas.At(MapId{0});
  ASSERT_EQ(map.At(KeyframeId{4}).scale, 0.75);
  ASSERT_EQ(map.culled().at(KeyframeId{2}).scale, 1.25);
  ASSERT_TRUE(map.At(KeyframeId{4}).loops.contains(KeyframeId{1}));
  WriteAtlas(atlas);
  ExpectSameAtlas(atlas, ReadMapFile(file_).atlas);
}

TEST_F(MapFileTest, TellsWhereItComesFrom) {
  SmallFile();
  const MapOrigin origin = ReadMapFile(file_).origin, expected = TestMapOrigin();
  EXPECT_EQ(origin.program, expected.program);
  EXPECT_EQ(origin.features, expected.features);
  EXPECT_EQ(origin.matcher, expected.matcher);
  EXPECT_EQ(origin.image_names, expected.image_names);
}

/// A run names its new keyframes; those that were culled since are not saved.
TEST_F(MapFileTest, NamesOfKeyframesThatAreGoneAreLeftOut) {
  MapOrigin origin = TestMapOrigin();
  origin.image_names[KeyframeId{2}] = "culled.png";
  origin.image_names[KeyframeId{1000}] = "never.png";
  WriteMapFile(file_, TestAtlas(7, 6, 4, 1), TestMapCamera(), origin);
  EXPECT_EQ(ReadMapFile(file_).origin.image_names, TestMapOrigin().image_names);
}

/// All bytes of the file are in a section or the header.
TEST_F(MapFileTest, CountsTheSections) {
  const std::string bytes = SmallFile();
  MapFileFacts facts;
  const LoadedAtlas loaded = ReadMapFile(file_, &facts);
  EXPECT_EQ(facts.version, kVersion);
  EXPECT_EQ(facts.bytes, bytes.size());
  uint64_t keyframes = 0, counted = kHeaderBytes;
  for (const MapId id : loaded.atlas.Remaining())
    keyframes += static_cast<uint64_t>(loaded.atlas.At(id).KeyframeCount());
  EXPECT_EQ(facts.sections["ATLS"].count, 1u);
  EXPECT_EQ(facts.sections["MAP "].count, 3u);
  EXPECT_EQ(facts.sections["FEAT"].count, keyframes);
  EXPECT_EQ(facts.sections["END "].count, 1u);
  EXPECT_EQ(facts.sections["END "].content_bytes, 0u);
  for (const auto& [kind, tally] : facts.sections) counted += tally.file_bytes;
  EXPECT_EQ(counted, bytes.size());
  uint64_t content = 0;
  for (const Section& section : Sections(bytes)) content += section.content.size();
  uint64_t tallied = 0;
  for (const auto& [kind, tally] : facts.sections) tallied += tally.content_bytes;
  EXPECT_EQ(tallied, content);
}

TEST_F(MapFileTest, SavingAgainGivesTheSameBytes) {
  const std::string bytes = SmallFile();
  const LoadedAtlas loaded = ReadMapFile(file_);
  WriteMapFile(file_, loaded.atlas, loaded.camera, loaded.origin);
  EXPECT_EQ(ReadAll(file_), bytes);
}

TEST_F(MapFileTest, GoesOnAfterReloading) {
  Atlas atlas = TestAtlas(10, 12, 8, 3);
  WriteAtlas(atlas);
  LoadedAtlas loaded = ReadMapFile(file_);
  for (Atlas* each : {&atlas, &loaded.atlas}) {
    Map& map = each->At(MapId{0});
    const KeyframeId added = each->ids().NextKeyframe();
    const Keyframe& last = map.At(KeyframeId{9});
    map.AddKeyframe(added, last.frame, last.cam_from_world);
    for (const LandmarkId landmark : last.landmarks) {
      if (landmark.valid()) map.AddObservation(added, 3, landmark);
    }
    map.ConnectToParent(added, last.id);
    map.RemoveKeyframe(KeyframeId{9});
    map.Rescale(1.5);
  }
  ExpectSameAtlas(atlas, loaded.atlas);
}

TEST_F(MapFileTest, AnEmptyAtlas) {
  WriteAtlas(Atlas());
  EXPECT_TRUE(ReadMapFile(file_).atlas.Remaining().empty());
}

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
  EXPECT_THAT(ErrorOfBytes(bytes), HasSubstr("version 4, of a newer program: expected 2 to 3"));
  EXPECT_THAT(ErrorOf([&] { ReadMapFile(folder_.path()); }), HasSubstr("expected a file"));
  EXPECT_THAT(ErrorOf([&] { ReadMapFile(folder_.path() / "none.deepuav"); }),
              HasSubstr("none.deepuav"));
}

/// The content of a map section as version 2 had it: no model noise, no measurements.
std::string AsVersionTwo(const std::string& content, int keyframes_with_loops) {
  constexpr size_t kNoise = 8, kMeasurement = 21;
  std::string old = content.substr(0, 8);
  size_t at = 8 + kNoise;
  const auto number = [&] {
    uint64_t value;
    std::memcpy(&value, content.data() + at, sizeof(value));
    return value;
  };
  const auto copy = [&](size_t bytes) {
    old += content.substr(at, bytes);
    at += bytes;
  };
  const auto copy_count = [&] {
    const uint64_t count = number();
    copy(8);
    return count;
  };
  for (uint64_t left = copy_count(); left > 0; --left) {
    copy(96);
    const uint64_t loops = copy_count();
    keyframes_with_loops -= loops > 0;
    copy(8 * loops);
  }
  EXPECT_EQ(keyframes_with_loops, 0);
  copy(88 * copy_count());
  copy(16 * copy_count());
  for (uint64_t left = copy_count(); left > 0; --left) {
    copy(100);
    for (uint64_t observations = copy_count(); observations > 0; --observations) {
      copy(12);
      at += kMeasurement;
    }
  }
  return old + content.substr(at);
}

TEST_F(MapFileTest, VersionTwoIsReadWithoutImagesAndWithKeyPointsAsMeasurements) {
  std::string bytes = std::string(kMagic) + Bytes(uint32_t{2});
  int maps = 0;
  for (const Section& section : Sections(SmallFile())) {
    const std::string_view kind(section.kind.data(), section.kind.size());
    if (kind == "IMAG") continue;
    const bool is_map = kind == "MAP ";
    // The first map has four keyframes left that loops tie.
    const std::string content =
        is_map ? AsVersionTwo(section.content, maps++ == 0 ? 2 : 0) : section.content;
    bytes += SealedSection(section.kind, 0, content.size(), content);
  }
  bytes += SealedSection({'E', 'N', 'D', ' '}, 0, 0, "");
  const LoadedAtlas loaded = ReadBytesAsMap(bytes);
  const Map& map = loaded.atlas.At(MapId{0});
  EXPECT_EQ(map.model_sigma_px(), 0);
  EXPECT_GT(map.LandmarkCount(), 0);
  map.keyframes().ForEach([](const Keyframe& keyframe) { EXPECT_FALSE(keyframe.frame.image); });
  map.landmarks().ForEach([&](const Landmark& landmark) {
    for (const Observation& o : landmark.observations) {
      const Keypoint& keypoint =
          map.At(o.keyframe).features().keypoints[static_cast<size_t>(o.keypoint)];
      EXPECT_EQ(o.measured.px, keypoint.px);
      EXPECT_EQ(o.measured.noise, PixelNoise(keypoint.sigma_px));
    }
  });
}

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

int64_t PeakMemoryKiB() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

/// Damages contents or bytes, reproducibly.
class Damage {
 public:
  explicit Damage(uint64_t seed) : random_(seed) {}

  void Change(std::string* bytes) {
    for (int left = 1 + random_.Index(4); left > 0 && !bytes->empty(); --left) {
      const size_t at = Position(*bytes);
      switch (random_.Index(5)) {
        case 0:
          (*bytes)[at] = static_cast<char>(random_.Index(256));
          break;
        case 1:
          PutNumber(at, bytes);
          break;
        case 2:
          bytes->erase(at, static_cast<size_t>(random_.Index(64)));
          break;
        case 3:
          bytes->insert(at,
                        bytes->substr(Position(*bytes), static_cast<size_t>(random_.Index(200))));
          break;
        default:
          std::swap((*bytes)[at], (*bytes)[Position(*bytes)]);
      }
    }
  }
  size_t Any(size_t count) { return static_cast<size_t>(random_.Index(static_cast<int>(count))); }

 private:
  size_t Position(const std::string& bytes) { return Any(bytes.size()); }
  void PutNumber(size_t at, std::string* bytes) {
    constexpr int64_t kNumbers[] = {0,
                                    1,
                                    2,
                                    3,
                                    -1,
                                    127,
                                    int64_t{1} << 31,
                                    INT64_MAX,
                                    INT64_MIN,
                                    0x7ff0000000000000,
                                    0x7ff8000000000000,
                                    int64_t{1} << 24,
                                    1000};
    const int64_t number = kNumbers[random_.Index(std::size(kNumbers))];
    const size_t fitting = std::min(sizeof(number), bytes->size() - at);
    std::memcpy(bytes->data() + at, &number, fitting);
  }

  Random random_;
};

class MapFileFuzzTest : public MapFileTest {
 protected:
  /// Runs `read`, which must return or throw Error with one line, soon and in little memory.
  void Try(const std::function<void()>& read) {
    const Stopwatch watch;
    try {
      read();
    } catch (const Error& error) {
      ++refused_;
      EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos) << error.what();
      EXPECT_THAT(error.what(), HasSubstr("damaged.deepuav: "));
    } catch (const std::exception& exception) {
      ADD_FAILURE() << "not an Error: " << exception.what();
    }
    EXPECT_LT(watch.Seconds(), 10);
    EXPECT_LT(PeakMemoryKiB() - memory_before_, 1 << 20);
  }

  const int64_t memory_before_ = PeakMemoryKiB();
  int refused_ = 0;
};

TEST_F(MapFileFuzzTest, DamagedBytes) {
  const std::string bytes = SmallFile();
  Damage damage(1);
  constexpr int kCount = 3000;
  int changed = 0;
  for (int i = 0; i < kCount && !HasFailure(); ++i) {
    std::string damaged = bytes;
    damage.Change(&damaged);
    changed += damaged != bytes;
    if (damaged != bytes) Try([&] { ReadBytesAsMap(damaged); });
  }
  EXPECT_EQ(refused_, changed);
  EXPECT_GT(changed, kCount / 2);
}

/// Damage that the checksums do not show: what is accepted must be a map that works.
TEST_F(MapFileFuzzTest, DamagedContents) {
  const std::vector<Section> sections = Sections(SmallFile());
  Damage damage(2);
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount && !HasFailure(); ++i) {
    std::vector<Section> damaged = sections;
    // Half in the first two: they hold the structure.
    const size_t count = i % 2 ? size_t{2} : damaged.size();
    damage.Change(&damaged[damage.Any(count)].content);
    if (i % 16 == 0)
      std::swap(damaged[damage.Any(damaged.size())], damaged[damage.Any(damaged.size())]);
    Try([&] {
      LoadedAtlas loaded = ReadSections(damaged);
      for (MapId map_id : loaded.atlas.Remaining()) {
        const Map& map = loaded.atlas.At(map_id);
        map.keyframes().ForEach([&](const Keyframe& keyframe) { map.MedianDepth(keyframe.id); });
        for (const auto& [keyframe, culled] : map.culled()) map.PoseOf(keyframe);
        for (const auto& [from, into] : map.merged_into()) map.Current(from);
        map.landmarks().ForEach([&](const Landmark& landmark) {
          loaded.atlas.At(map.id()).UpdateAppearance(landmark.id);
        });
      }
    });
  }
  EXPECT_GT(refused_, kCount / 2);
  EXPECT_LT(refused_, kCount);
}

}  // namespace
}  // namespace deepuav
