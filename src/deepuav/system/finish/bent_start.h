#pragma once

#include <functional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/localisation/frame_locator.h"
#include "deepuav/map/map.h"
#include "deepuav/map/requests.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

struct BentStartOptions {
  bool enabled = true;
  int min_later_keyframes = 5;   ///< Of a map that can tell.
  int max_misses = 3;            ///< Frames in a row that it does not show, which end the search.
  double min_later_share = 0.5;  ///< Later landmarks that a first keyframe sees over all it saw...
  double max_agreeing = 0.5;     ///< ...and the share of them that agree with where it is, up to
                                 ///< which it is elsewhere...
  double chi_square = 5.991;     ///< ...as 95 % of a 2-D error do.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "",
          "whether the first keyframes of a map are looked for in what was built after them");
    visit("min_later_keyframes", min_later_keyframes, "", "of a map that can tell",
          Between(2, 1'000'000));
    visit("max_misses", max_misses, "",
          "frames in a row that such a map does not show, which end the search",
          Between(1, 1'000'000));
    visit("min_later_share", min_later_share, "",
          "later landmarks that a first keyframe sees over those that it saw itself, of one that "
          "may be elsewhere",
          Between(0, 100));
    visit("max_agreeing", max_agreeing, "",
          "share of them that agree with where it is, up to which it is elsewhere", Between(0, 1));
    visit("chi_square", chi_square, "",
          "bound on the squared error in standard deviations of one that agrees", Above(0, 1e6));
  }
};

/// A map that begins with little parallax and much shaking may begin bent: its first keyframes hold
/// together by landmarks of their own, metres from where all that was built later sees them, and no
/// adjustment moves them over. They are looked for in that later map alone, backwards from its
/// first frame.
class BentStart {
 public:
  /// `first_frames`: of a map, which are looked at. Keyframes before `first_new_keyframe` are not
  /// of this run.
  BentStart(const Pinhole& pinhole, const BentStartOptions& options,
            const LocalMapOptions& local_map_options, int first_frames,
            KeyframeId first_new_keyframe, FrameLocator* locator);

  /// The first keyframes that are elsewhere than they should be, for a map that was adjusted and
  /// records with the poses that it gives them; by id. `stop` as elsewhere.
  std::vector<KeyframeRelocation> FindIn(const Map& map, const std::vector<FrameRecord>& records,
                                         const std::function<bool()>& stop = nullptr) const;

 private:
  struct Found;
  /// The keyframes among the first `young` records, as far as the later map shows them, from the
  /// last one on.
  std::vector<Found> LocateBackwards(const Map& map, const Map& later,
                                     const std::vector<const FrameRecord*>& records, size_t young,
                                     const std::function<bool()>& stop) const;
  bool IsWrong(const Keyframe& keyframe, const Map& later, const FrameRecord& found) const;

  const Pinhole pinhole_;
  const BentStartOptions options_;
  const LocalMapOptions local_map_options_;
  const size_t first_frames_;
  const KeyframeId first_new_keyframe_;
  FrameLocator* locator_;
};

}  // namespace deepuav
