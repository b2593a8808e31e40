#include "deepuav/assembly/output/run_facts.h"

#include <sys/resource.h>

#include <algorithm>

namespace deepuav {

RunFacts FactsOf(const Eyes& eyes, const RunSettings& settings) {
  RunFacts facts;
  facts.features = eyes.extractor().Description();
  facts.matcher = eyes.matcher().Description();
  facts.vocabulary = eyes.VocabularyDescription();
  facts.models = eyes.models();
  facts.options = OptionTexts(settings.registry);
  facts.options_yaml = settings.asked_yaml;
  return facts;
}

FrameCounts FramesByMap(const Atlas& atlas, const SlamResult& result) {
  FrameCounts frames;
  for (MapId map : atlas.Remaining()) frames[map] = 0;
  for (const FrameRecord& record : result.frames) {
    if (record.located()) ++frames[atlas.Current(record.map)];
  }
  return frames;
}

MapId MainMap(const FrameCounts& frames_by_map) {
  if (frames_by_map.empty()) return {};
  return std::max_element(frames_by_map.begin(), frames_by_map.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

double PeakResidentMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace deepuav
