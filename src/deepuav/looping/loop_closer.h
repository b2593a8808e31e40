#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/stages.h"
#include "deepuav/looping/drift.h"
#include "deepuav/looping/essential_graph.h"
#include "deepuav/looping/loop_verifier.h"
#include "deepuav/looping/place_memory.h"
#include "deepuav/looping/turns_to_try.h"

namespace deepuav {

struct LoopingOptions {
  bool enabled = true;
  int agreeing_keyframes = 3;  ///< That must find the same loop before it is closed...
  int memory_keyframes = 10;   ///< ...among this many.
  double max_disagreement_px = 25;
  double max_scale_disagreement = 0.15;  ///< Of the natural logarithm.
  int rest_keyframes = 5;                ///< After a closed loop, until the next in the same map.
  int moved_keyframes = 30;  ///< Around the newest one, which move as one before the rest follows.
  int min_near_shared = 15;  ///< Landmarks that keyframes share to be near one another.
  RecogniserOptions recogniser;
  RelocaliserOptions relocaliser;
  VerifierOptions verifier;
  DriftOptions drift;
  TurnsToTryOptions turns;
  EssentialGraphOptions essential_graph;

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "", "close loops and join maps where places are seen again");
    visit("agreeing_keyframes", agreeing_keyframes, "",
          "keyframes that must find the same loop before it is closed", Between(1, 1000));
    visit("memory_keyframes", memory_keyframes, "", "newest keyframes among which they must be",
          Between(1, 10'000));
    visit("max_disagreement_px", max_disagreement_px, "px",
          "between where two keyframes see the loop's place", Above(0, 10'000));
    visit("max_scale_disagreement", max_scale_disagreement, "",
          "natural logarithm of the ratio of two keyframes' scales of the loop", Above(0, 100));
    visit("rest_keyframes", rest_keyframes, "",
          "keyframes after a closed loop until the next in the same map", Between(0, 1'000'000));
    visit("moved_keyframes", moved_keyframes, "",
          "keyframes around the newest that move as one before the rest follows",
          Between(1, 1'000'000));
    visit("min_near_shared", min_near_shared, "",
          "landmarks that keyframes share to be near one another", Between(1, 1'000'000));
    visit.Part("recogniser", recogniser);
    visit.Part("relocaliser", relocaliser);
    visit.Part("verifier", verifier);
    visit.Part("drift", drift);
    visit.Part("turns", turns);
    visit.Part("essential_graph", essential_graph);
  }
};

/// Recognises places (Mur-Artal 2015, section VII; Campos 2021, section VI) and says how the map
/// has to change. Reads the atlas, never writes it. Thread-compatible; keeps no thread of its own.
class LoopCloser {
 public:
  /// The pointers must outlive it; `stages` may be null. `places` remembers earlier keyframes,
  /// which is up to the caller. `locator` as of Relocaliser.
  LoopCloser(const Camera& camera, const LoopingOptions& options, const LocatorOptions& locator,
             PlaceMemory* places, PlaceMatchers matchers, StageListener* stages);

  /// Under which headings the keyframe could look like what is not around it: those that its map
  /// has seen places under, and all where there are other maps, of whose heading nothing is known.
  QuarterTurns TurnsFor(const Atlas& atlas, MapId map, KeyframeId keyframe) const;

  /// Takes the newest keyframe; `turned` are its descriptors under other headings, those not asked
  /// for empty, or none. Gives the correction once enough keyframes agree on a loop.
  std::optional<MapCorrection> Process(const Atlas& atlas, MapId map, KeyframeId keyframe,
                                       std::span<const Descriptors> turned);

 private:
  std::optional<LoopFinding> Find(const Atlas& atlas, MapId map, KeyframeId keyframe,
                                  std::span<const Descriptors> turned);
  std::vector<LoopFinding> AgreeingWith(const Atlas& atlas, const LoopFinding& newest) const;
  bool Agree(const Atlas& atlas, const LoopFinding& earlier, const LoopFinding& newest) const;
  MapCorrection MakeCorrection(const Atlas& atlas, const std::vector<LoopFinding>& findings) const;
  void Forget(const Atlas& atlas);

  const Camera camera_;
  const LoopingOptions options_;
  StageListener* stages_;
  PlaceMemory* places_;
  Relocaliser relocaliser_;
  LoopVerifier verifier_;
  /// A finding and the count of processed keyframes when it was made.
  struct Remembered {
    LoopFinding finding;
    int64_t processed = 0;
  };
  std::deque<Remembered> findings_;  ///< Of the newest keyframes, by age.
  int64_t processed_ = 0;            ///< Keyframes.
  int64_t rest_until_ = 0;           ///< Count of processed keyframes.
};

}  // namespace deepuav
