#include "deepuav/io/maps/map_file.h"

#include "deepuav/io/testing/map_file_test_support.h"

namespace deepuav {
namespace {

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

/// The content of a map section as version 3 had it, without normals, or version 2, without model
/// noise and measurements, too.
std::string AsVersion(uint32_t version, const std::string& content, int keyframes_with_loops) {
  const size_t kNoise = version == 2 ? 8 : 0, kMeasurement = version == 2 ? 21 : 0;
  constexpr size_t kNormal = 24, kObservation = 33;
  std::string old = content.substr(0, 16 - kNoise);
  size_t at = 16;
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
    copy(64);
    at += kNormal;
    copy(36);
    for (uint64_t observations = copy_count(); observations > 0; --observations) {
      copy(kObservation - kMeasurement);
      at += kMeasurement;
    }
  }
  return old + content.substr(at);
}

TEST_F(MapFileTest, VersionThreeIsReadWithoutNormals) {
  std::string bytes = std::string(kMagic) + Bytes(uint32_t{3});
  int maps = 0;
  for (const Section& section : Sections(SmallFile())) {
    const bool is_map = std::string_view(section.kind.data(), section.kind.size()) == "MAP ";
    const std::string content =
        is_map ? AsVersion(3, section.content, maps++ == 0 ? 2 : 0) : section.content;
    bytes += SealedSection(section.kind, 0, content.size(), content);
  }
  bytes += SealedSection({'E', 'N', 'D', ' '}, 0, 0, "");
  const LoadedAtlas whole = ReadMapFile(file_);
  const LoadedAtlas loaded = ReadBytesAsMap(bytes);
  int with_normal = 0;
  loaded.atlas.At(MapId{0}).landmarks().ForEach([&](const Landmark& landmark) {
    EXPECT_TRUE(landmark.normal_world.isZero(0));
    const Landmark& now = whole.atlas.At(MapId{0}).At(landmark.id);
    EXPECT_EQ(landmark.position_world, now.position_world);
    ASSERT_EQ(landmark.observations.size(), now.observations.size());
    EXPECT_EQ(landmark.observations[0].measured.px, now.observations[0].measured.px);
    with_normal += !now.normal_world.isZero(0);
  });
  EXPECT_GT(with_normal, 0) << "else nothing is tested";
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
        is_map ? AsVersion(2, section.content, maps++ == 0 ? 2 : 0) : section.content;
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

}  // namespace
}  // namespace deepuav
