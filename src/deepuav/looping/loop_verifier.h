#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/poses/sim3_optimisation.h"
#include "deepuav/localisation/relocaliser.h"
#include "deepuav/looping/place_memory.h"
#include "deepuav/map/map_correction.h"

namespace deepuav {

struct VerifierOptions {
  int min_pairs = 15;  ///< Landmarks of the keyframe and of the place that prove to be the same.
  double min_pair_ratio = 0.4;   ///< Of those seen twice.
  double max_known_ratio = 0.3;  ///< Of the place's landmarks seen, those that the keyframe has.
  int max_samples = 500;  ///< Of the RANSAC for the keyframe's pose. Fewer than for a lost frame: a
                          ///< loop missed by one keyframe is found by the next.
  LocalMapOptions place;
  Sim3OptimisationOptions sim3;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_pairs", min_pairs, "",
          "landmarks of the keyframe and of the place that prove to be the same",
          Between(3, 100'000));
    visit("max_known_ratio", max_known_ratio, "",
          "of the place's landmarks seen, those that the keyframe has: more is no loop",
          Between(0, 1));
    visit("min_pair_ratio", min_pair_ratio, "", "of the landmarks seen twice, those that agree",
          Between(0, 1));
    visit("max_samples", max_samples, "", "of the RANSAC for the keyframe's pose",
          Between(1, 10'000));
    visit.Part("place", place);
    visit.Part("sim3", sim3);
  }
};

/// A keyframe found at a place that the map knows already, or another map does.
struct LoopFinding {
  MapId map, place_map;
  LoopTie tie;
  SE3 cam_from_place_world;   ///< The keyframe's pose by the landmarks of the place.
  Sim3 place_from_map_world;  ///< Moves the keyframe's surroundings to where the place says.
};

/// Decides by geometry whether a keyframe is at a place. Thread-compatible.
class LoopVerifier {
 public:
  /// `relocaliser` must outlive it.
  LoopVerifier(const Pinhole& pinhole, const VerifierOptions& options, Relocaliser* relocaliser);

  /// The first of `places` (most similar first) where the keyframe is: its pose there must be sure
  /// (as for a relocalised frame), and its own landmarks must agree with those of the place up to
  /// one similarity (Mur-Artal 2015, section VII-B; the pose comes from PnP instead of three
  /// landmark pairs, since far more key points match landmarks of the place than have one
  /// themselves). `turned` as of Relocaliser. `reason` (if given) says why there is none.
  std::optional<LoopFinding> Verify(const Atlas& atlas, MapId map, KeyframeId keyframe,
                                    std::span<const Descriptors> turned,
                                    std::span<const PlaceCandidate> places,
                                    std::string* reason = nullptr);

 private:
  std::optional<LoopFinding> Compare(const Map& map, const Keyframe& keyframe, const Map& place_map,
                                     const LocalMap& place, const Relocaliser::Found& found,
                                     std::string* reason) const;
  /// The landmarks that both sides know: a in the keyframe's camera, b in that of the place's
  /// centre.
  std::vector<Sim3Correspondence> PairLandmarks(const Map& map, const Keyframe& keyframe,
                                                const LocalMap& place,
                                                const LocatedFrame& located) const;

  const Pinhole pinhole_;
  const VerifierOptions options_;
  Relocaliser* relocaliser_;
};

}  // namespace deepuav
