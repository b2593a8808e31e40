#pragma once

#include <functional>
#include <map>
#include <optional>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// When what a map says of a shutter's readout counts.
struct ReadoutSearchOptions {
  bool enabled = true;
  int min_keyframes = 10;         ///< That move, in the map.
  double min_cost_share = 0.015;  ///< By which a first readout must lower the map's errors.
  double min_sigmas = 10;         ///< Of the first readout, over its standard deviation.
  double min_s = 0.003;           ///< A shorter one may be other errors, and does little harm...
  double max_s = 0.05;            ///< ...and no camera takes longer.
  bool refine_known = false;      ///< Of a readout that was told, find how much it is off...
  double off_sigmas = 3;          ///< ...if by so many standard deviations at least.
  /// Of the errors of a map, corrected for a readout as often as it is, that it still saves, from
  /// which on the map was spoilt.
  double begin_anew_share = 0.05;

  void Check() const;
  void CheckRelations() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "",
          "find the readout of a rolling shutter where none is known, at the end of a run");
    visit("min_keyframes", min_keyframes, "",
          "keyframes that move, of a map that may tell a readout", Between(2, 1'000'000));
    visit("min_cost_share", min_cost_share, "",
          "share of the cost of a map's errors that a readout must save", Between(0, 1));
    visit("min_sigmas", min_sigmas, "", "readout over its standard deviation, at least",
          Between(0, 1e6));
    visit("min_s", min_s, "s", "shortest readout that is believed", Above(0, 1));
    visit("max_s", max_s, "s", "longest readout that is believed", Above(0, 10));
    visit("refine_known", refine_known, "", "find how much a readout is off that was told");
    visit("off_sigmas", off_sigmas, "",
          "that much over its standard deviation, from which on it is mended", Between(0, 1e6));
    visit("begin_anew_share", begin_anew_share, "",
          "share of the errors that the last round of finding a readout saves, from which on a "
          "dataset is run once more with it from its first image on; 1: never",
          Between(0, 1));
  }
};

/// What a map says of its camera's readout.
struct FoundReadout {
  double change_s = 0;  ///< Of what the measurements are corrected for.
  double sigma_s = 0;
  double cost_share = 0;  ///< Of the map's errors that it saves.
};

/// Whether a first readout is more than what else may be wrong.
bool IsBelieved(const FoundReadout& found, const ReadoutSearchOptions& options);

/// Whether a readout that is known is off by more than chance.
bool IsOff(const FoundReadout& found, const ReadoutSearchOptions& options);

/// The readout under which the observations of an adjusted map fit best, poses and landmarks free;
/// they are left as they are. `motion_per_s`: how keyframes would move in a readout of one second,
/// in the map's units; what they did is corrected already as far as the keyframes know. Nothing
/// where nothing moves, or few keyframes do.
std::optional<FoundReadout> FindReadout(const Map& map, const Camera& camera,
                                        const std::map<KeyframeId, ReadoutMotion>& motion_per_s,
                                        const BundleOptions& bundle,
                                        const ReadoutSearchOptions& options,
                                        const std::function<bool()>& stop = nullptr);

}  // namespace deepuav
