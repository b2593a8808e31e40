#include <sys/resource.h>

#include <functional>

#include "deepuav/base/random.h"
#include "deepuav/base/time.h"
#include "deepuav/io/testing/map_file_test_support.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

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
