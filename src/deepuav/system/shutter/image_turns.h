#pragma once

#include <functional>
#include <map>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/poses/turning_pose.h"
#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_path.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/system/shutter/readout_path.h"

namespace deepuav {

struct ImageTurnOptions {
  int rounds = 3;            ///< Of images telling turns, and the map adjusted to them...
  int bend_rounds = 3;       ///< ...and then of turns that bend.
  double slow_s = 1;         ///< Turns that last longer than this are the path's.
  double max_step_s = 0.2;   ///< Between images whose poses tell how the camera turned.
  double sigma_rad = 0.003;  ///< Of a turn that an image told, when a run begins anew.
  /// Of a map that may tell: what a few have in common may as well be a bent map.
  int min_keyframes = 12;
  double min_spread = 1.5;     ///< Of these turns over their standard deviation, to be believed.
  double max_sigma_ratio = 3;  ///< Of an image's turn over the median of all, to be sure.
  double assumed_readout_s = 0.02;     ///< Where it is not known, while images are asked...
  double untold_cost_share = 0.05;     ///< ...and what they must save of their errors then.
  int first_images = 120;              ///< Asked before all are, so that those of a shutter...
  int first_stretch = 30;              ///< ...that reads all rows at once cost little, in a row...
  double first_share = 0.5;            ///< ...of what all must save, that these must.
  double max_readout_sigma_s = 0.003;  ///< Of one that is found then, to be believed.
  double min_cost_share = 0.02;     ///< Of the images' errors, that turns of their own must save...
  double begin_anew_share = 0.05;   ///< ...and from which on a run begins anew, knowing them.
  double begin_again_share = 0.02;  ///< Of images that tell theirs only then, to do so once more.
  TurningPoseOptions pose;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rounds", rounds, "",
          "times that images read by a rolling shutter tell how the camera turned meanwhile, where "
          "its path does not, and the map is adjusted to that; 0: never",
          Between(0, 20));
    visit("bend_rounds", bend_rounds, "", "and then of turns that change meanwhile",
          Between(0, 20));
    visit("slow_s", slow_s, "s", "turns that last longer are those of the path", Above(0, 60));
    visit("max_step_s", max_step_s, "s", "between images whose poses tell a turn", Above(0, 10));
    visit("sigma_rad", sigma_rad, "rad",
          "standard deviation of a turn that an image told, for the run that begins anew",
          Between(0, 10));
    visit("max_sigma_ratio", max_sigma_ratio, "",
          "standard deviation of an image's turn over the median of all, up to which it is sure",
          Between(1, 1000));
    visit("min_keyframes", min_keyframes, "", "keyframes of a map that may tell turns of images",
          Between(2, 1'000'000));
    visit("assumed_readout_s", assumed_readout_s, "s",
          "readout of a camera of which nothing tells whether it reads all rows at once, while "
          "images are asked whether they turned",
          Above(0, 1));
    visit("untold_cost_share", untold_cost_share, "",
          "share of the images' errors that turns of their own must save there; 1: never",
          Between(0, 1));
    visit("first_images", first_images, "",
          "images that are asked first there, and all of them only if these say so",
          Between(1, 1'000'000));
    visit("first_stretch", first_stretch, "", "of these, so many in a row", Between(2, 1'000'000));
    visit("first_share", first_share, "", "of the share to be saved, that they must save",
          Between(0, 1));
    visit("max_readout_sigma_s", max_readout_sigma_s, "s",
          "standard deviation of the readout found there, at most: else it stays as assumed",
          Above(0, 1));
    visit("min_spread", min_spread, "",
          "turns that images tell over what their noise would make of none, at least, root mean "
          "square: else the path knows better",
          Between(0, 1000));
    visit("min_cost_share", min_cost_share, "",
          "share of the images' errors that turns of their own must save", Between(0, 1));
    visit("begin_anew_share", begin_anew_share, "",
          "share from which on a run begins anew, knowing these turns", Between(0, 1));
    visit(
        "begin_again_share", begin_again_share, "",
        "share of the images that tell their turns only in the run that began anew, from which on "
        "it does so once more; 1: never",
        Between(0, 1));
    pose.Visit(visit);
  }
};

/// How the camera turned while a rolling shutter read each image, as the image's own rows say.
struct ImageTurns {
  std::map<Timestamp, ReadoutMotion> motions;       ///< Turn and bend alone.
  std::map<Timestamp, ReadoutMotion> slow_motions;  ///< The path's, of images that told nothing.
  /// Of the images' errors against the map, what these turns save beside those known so far.
  double saved_share = 0;
  /// Root mean square of how they differ from those known so far, and of their noise, rad.
  double changed_rad = 0, noise_rad = 0;
};

/// A camera that shakes faster than its images come leaves no trace of that in its path; but each
/// image shows the map bent by its own turn, to a milliradian. What all images of a while have in
/// common may as well be a shear of the map (Albl et al. 2016, Degeneracies in Rolling Shutter
/// SfM), so the slow part of the turns is replaced by that of the path, which knows it well.
/// Frames that are located in the map but see too little turn as the path slowly does. Nothing once
/// `stop` says true.
ImageTurns MeasureImageTurns(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                             const PoseOfFrame& pose_of_frame, const Camera& camera,
                             TurnModel model, const ImageTurnOptions& options,
                             const std::function<bool()>& stop = nullptr);

/// Records in a row, spread over all, that are about `first_images` together; all where there are
/// no more.
std::vector<FrameRecord> FirstAsked(const std::vector<FrameRecord>& records,
                                    const ImageTurnOptions& options);

/// How a path turns slowly, in a readout. Of poses between others alone that are not far.
std::map<Timestamp, ReadoutMotion> SlowTurns(const Trajectory& path, double readout_s,
                                             const ImageTurnOptions& options);

/// Whether images show turns that are not known yet.
bool AreBelieved(const ImageTurns& turns, double min_cost_share, const ImageTurnOptions& options);

/// Has the path's images turn so.
void TakeTurns(const ImageTurns& turns, ReadoutPath* path);

/// What images told counts as measured from now on.
void MarkMeasured(const ImageTurns& turns, const Atlas& atlas, MapId map,
                  std::vector<FrameRecord>* records);

}  // namespace deepuav
