#include "deepuav/io/maps/map_file.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/io/files/section_file.h"
#include "deepuav/io/maps/map_sections.h"
#include "deepuav/io/maps/trailing_sections.h"

namespace deepuav {
namespace {

constexpr std::string_view kMagic = "\x89UAVMAP\n";
constexpr SectionKind kAtlas = {'A', 'T', 'L', 'S'};
constexpr SectionKind kMap = {'M', 'A', 'P', ' '};
constexpr SectionKind kFeatures = {'F', 'E', 'A', 'T'};
constexpr SectionKind kImage = {'I', 'M', 'A', 'G'};
constexpr SectionKind kGauges = {'G', 'A', 'U', 'G'};
constexpr SectionKind kMetricGauges = {'M', 'E', 'T', 'R'};
constexpr SectionKind kMotions = {'T', 'U', 'R', 'N'};
constexpr SectionKind kMotionsWithoutBends = {'R', 'O', 'W', 'S'};

// A map takes memory for every id up to its largest: so many, and one a byte of the file, are far
// more than any run uses, yet cost little.
constexpr uint64_t kFreeIds = uint64_t{1} << 24;

class AtlasReader {
 public:
  explicit AtlasReader(const std::filesystem::path& file)
      : sections_(file, kMagic, kOldestMapFileVersion, kMapFileVersion) {}

  LoadedAtlas Read() {
    head_ = GetAtlasHead(sections_.Read(kAtlas));
    LoadedAtlas loaded;
    loaded.camera = head_.camera;
    loaded.origin = {head_.program, head_.features, head_.matcher, {}};
    loaded.atlas.ids() = head_.ids;
    for (uint64_t i = 0; i < head_.maps; ++i) {
      MapState state = ReadMap(&loaded.origin.image_names);
      if (state.id != loaded.atlas.NextMap()) {
        throw Error("map {}: expected map {}", state.id.value, loaded.atlas.NextMap().value);
      }
      loaded.atlas.Add(Map::Restore(std::move(state)));
    }
    if (sections_.NextIs(kGauges)) SetGauges(GetGauges(sections_.Read(kGauges)), &loaded.atlas);
    if (sections_.NextIs(kMetricGauges))
      SetGauges(GetMetricGauges(sections_.Read(kMetricGauges)), &loaded.atlas);
    for (const SectionKind& kind : {kMotionsWithoutBends, kMotions}) {
      if (!sections_.NextIs(kind)) continue;
      SetMotions(GetMotions(sections_.Read(kind), kind == kMotions), &loaded.atlas);
    }
    sections_.ExpectEnd();
    CheckCounter(head_.ids.keyframes, "keyframe");
    CheckCounter(head_.ids.landmarks, "landmark");
    CheckUnique(&keyframes_, "keyframe");
    CheckUnique(&landmarks_, "landmark");
    return loaded;
  }

  /// After Read().
  MapFileFacts Facts() const {
    return {sections_.version(), sections_.position(), sections_.tallies()};
  }

 private:
  MapState ReadMap(std::map<KeyframeId, std::string>* image_names) {
    const bool is_old = sections_.version() == kOldestMapFileVersion;
    MapState state = GetMap(sections_.Read(kMap), sections_.version(), image_names);
    for (Keyframe& keyframe : state.keyframes) {
      keyframe.frame.features =
          std::make_shared<const Features>(GetFeatures(keyframe.id, sections_.Read(kFeatures)));
      if (is_old) continue;
      keyframe.frame.image = GetImage(keyframe.id, sections_.Read(kImage));
      CheckSize(keyframe);
    }
    if (is_old) MeasureAtKeypoints(&state);
    CheckIds(state);
    return state;
  }

  void CheckSize(const Keyframe& keyframe) const {
    if (!keyframe.frame.image) return;
    const cv::Size size = keyframe.frame.image->image().size();
    if (size.width == head_.camera.width && size.height == head_.camera.height) return;
    throw Error("the image of keyframe {} is {}x{}: expected the camera's {}x{}", keyframe.id.value,
                size.width, size.height, head_.camera.width, head_.camera.height);
  }

  void SetGauges(const std::map<MapId, Gauge>& gauges, Atlas* atlas) {
    for (const auto& [map, gauge] : gauges) {
      if (map.value < 0 || map >= atlas->NextMap())
        throw Error("map {} has a gauge: expected one of {} maps", map.value, head_.maps);
      if (atlas->GaugeOf(map).kind != GaugeKind::kFree)
        throw Error("map {} has two gauges: expected one", map.value);
      atlas->ChangeGauge(map, Sim3(), gauge);
    }
  }

  void SetMotions(const std::map<KeyframeId, ReadoutMotion>& motions, Atlas* atlas) {
    size_t set = 0;
    for (const MapId id : atlas->Remaining()) {
      Map& map = atlas->At(id);
      for (const auto& [keyframe, motion] : motions) {
        if (!map.Contains(keyframe)) continue;
        map.SetMotion(keyframe, motion);
        ++set;
      }
    }
    if (set != motions.size())
      throw Error("{} keyframes moved: expected that the maps hold them, found {}", motions.size(),
                  set);
  }

  void CheckIds(const MapState& state) {
    CollectIds(state.keyframes, head_.ids.keyframes, "keyframe", &keyframes_);
    CollectIds(state.landmarks, head_.ids.landmarks, "landmark", &landmarks_);
    for (const auto& [id, culled] : state.culled) CheckGiven(id, head_.ids.keyframes, "keyframe");
    for (const auto& [from, into] : state.merged_into) {
      CheckGiven(from, head_.ids.landmarks, "landmark");
      CheckGiven(into, head_.ids.landmarks, "landmark");
    }
    for (const Landmark& landmark : state.landmarks) {
      CheckGiven(landmark.created_by, head_.ids.keyframes, "keyframe");
    }
  }

  template <typename Thing, typename IdType>
  void CollectIds(const std::vector<Thing>& things, int64_t given, const char* kind,
                  std::vector<IdType>* ids) {
    IdType largest;
    for (const Thing& thing : things) {
      CheckGiven(thing.id, given, kind);
      largest = std::max(largest, thing.id);
      ids->push_back(thing.id);
    }
    id_slots_ += static_cast<uint64_t>(largest.value + 1);
    if (id_slots_ > MostIds()) {
      throw Error("{} {}: expected ids that sum to at most {} in a file of this size", kind,
                  largest.value, MostIds());
    }
  }

  void CheckCounter(int64_t given, const char* kind) const {
    if (given < 0 || static_cast<uint64_t>(given) > MostIds()) {
      throw Error("{} {}s were numbered: expected 0 to {} in a file of this size", given, kind,
                  MostIds());
    }
  }

  uint64_t MostIds() const { return kFreeIds + sections_.content_bytes(); }

  template <typename IdType>
  static void CheckGiven(IdType id, int64_t given, const char* kind) {
    if (id.value < -1 || id.value >= given) {
      throw Error("{} {}: expected fewer than the {} that were numbered", kind, id.value, given);
    }
  }

  template <typename IdType>
  static void CheckUnique(std::vector<IdType>* ids, const char* kind) {
    std::sort(ids->begin(), ids->end());
    const auto twice = std::adjacent_find(ids->begin(), ids->end());
    if (twice != ids->end()) {
      throw Error("{} {} is in two maps: expected it in one", kind, twice->value);
    }
  }

  SectionReader sections_;
  AtlasHead head_;
  std::vector<KeyframeId> keyframes_;  ///< Of all maps read so far.
  std::vector<LandmarkId> landmarks_;
  uint64_t id_slots_ = 0;
};

}  // namespace

std::map<MapId, int64_t> NumbersInFile(const Atlas& atlas) {
  std::map<MapId, int64_t> numbers;
  for (const MapId map : atlas.Remaining())
    numbers.emplace(map, static_cast<int64_t>(numbers.size()));
  return numbers;
}

namespace {

std::map<KeyframeId, ReadoutMotion> MotionsIn(const Atlas& atlas) {
  std::map<KeyframeId, ReadoutMotion> motions;
  for (const MapId map : atlas.Remaining()) {
    atlas.At(map).keyframes().ForEach([&](const Keyframe& keyframe) {
      if (!keyframe.frame.motion.IsNone()) motions.emplace(keyframe.id, keyframe.frame.motion);
    });
  }
  return motions;
}

std::map<MapId, Gauge> GaugesInFile(const Atlas& atlas, GaugeKind kind) {
  std::map<MapId, Gauge> gauges;
  for (const auto& [map, number] : NumbersInFile(atlas)) {
    const Gauge gauge = atlas.GaugeOf(map);
    if (gauge.kind == kind) gauges[{number}] = gauge;
  }
  return gauges;
}

}  // namespace

void WriteMapFile(const std::filesystem::path& file, const Atlas& atlas, const Camera& camera,
                  const MapOrigin& origin) {
  SectionWriter sections(file, kMagic, kMapFileVersion);
  ByteWriter bytes;
  const auto write = [&](const SectionKind& kind) {
    sections.Write(kind, bytes.bytes());
    bytes.Clear();
  };
  const std::vector<MapId> maps = atlas.Remaining();
  PutAtlasHead({camera, atlas.ids(), maps.size(), origin.program, origin.features, origin.matcher},
               &bytes);
  write(kAtlas);
  for (size_t i = 0; i < maps.size(); ++i) {
    const Map& map = atlas.At(maps[i]);
    PutMap(map, {static_cast<int64_t>(i)}, origin.image_names, &bytes);
    write(kMap);
    map.keyframes().ForEach([&](const Keyframe& keyframe) {
      PutFeatures(keyframe.id, keyframe.features(), &bytes);
      write(kFeatures);
      PutImage(keyframe.id, keyframe.frame.image.get(), &bytes);
      write(kImage);
    });
  }
  if (const auto gauges = GaugesInFile(atlas, GaugeKind::kGeoreferenced); !gauges.empty()) {
    PutGauges(gauges, &bytes);
    write(kGauges);
  }
  if (const auto gauges = GaugesInFile(atlas, GaugeKind::kMetric); !gauges.empty()) {
    PutMetricGauges(gauges, &bytes);
    write(kMetricGauges);
  }
  if (const auto motions = MotionsIn(atlas); !motions.empty()) {
    PutMotions(motions, &bytes);
    write(kMotions);
  }
  sections.Commit();
}

LoadedAtlas ReadMapFile(const std::filesystem::path& file, MapFileFacts* facts) {
  RefuseNamedPipe(file);
  try {
    AtlasReader reader(file);
    LoadedAtlas loaded = reader.Read();
    if (facts) *facts = reader.Facts();
    return loaded;
  } catch (const Error& error) {
    throw Error("{}: {}", file.string(), error.what());
  }
}

}  // namespace deepuav
