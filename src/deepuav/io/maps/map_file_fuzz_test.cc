#include "deepuav/base/random.h"
#include "deepuav/io/testing/map_file_test_support.h"
#include "support/fuzzing.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

/// Damages contents or bytes, reproducibly.
class Damage {
 public:
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

  Random random_{FuzzSeed()};
};

class MapFileFuzzTest : public MapFileTest {
 protected:
  /// Runs `read`; an Error names the file.
  void Try(const std::function<void()>& read) {
    try {
      read();
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("damaged.deepuav: "));
      throw;
    }
  }
};

TEST_F(MapFileFuzzTest, DamagedBytes) {
  const std::string bytes = SmallFile();
  Damage damage;
  int64_t changed = 0;
  const FuzzCounts counts = FuzzInputs(3000, [&](int64_t) {
    std::string damaged = bytes;
    damage.Change(&damaged);
    if (damaged == bytes) return;
    ++changed;
    Try([&] { ReadBytesAsMap(damaged); });
  });
  EXPECT_EQ(counts.refused, changed);
  EXPECT_GT(changed, counts.inputs / 2);
}

/// Damage that the checksums do not show: what is accepted must be a map that works.
TEST_F(MapFileFuzzTest, DamagedContents) {
  const std::vector<Section> sections = Sections(SmallFile());
  Damage damage;
  const FuzzCounts counts = FuzzInputs(20000, [&](int64_t i) {
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
  });
  EXPECT_GT(counts.refused, counts.inputs / 2);
  EXPECT_LT(counts.refused, counts.inputs);
}

}  // namespace
}  // namespace deepuav
