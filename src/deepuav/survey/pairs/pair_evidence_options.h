#pragma once

#include "deepuav/base/option_check.h"

namespace deepuav {

/// What the matches of two photographs say for a map or against it.
struct PairEvidenceOptions {
  double explained_share = 0.5;       ///< Of a pair's matches, agree with a map that explains it.
  double contradicting_share = 0.25;  ///< Agree, below which the map has the pair elsewhere.
  int telling_points = 8;       ///< Of the map, matched; with fewer, epipolar lines are asked.
  double map_error_factor = 2;  ///< Over survey.pair_error_px, before all is adjusted well.
  double rough_plane_px = 12;   ///< From a homography: the ground is no plane.
  int telling_keypoints = 5;    ///< In a cell of a photograph, to know whether they match.
  int telling_cells = 3;        ///< That both photographs see, to know how far matches spread.
  double coverage_power = 6;    ///< Of a pair's coverage, in its weight: a wrong place is held by
                                ///< many matches, but of low coverage.
  double doubtful_ratio = 0.1;  ///< Said against a photograph, over what is said for it.

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("explained_share", explained_share, "",
          "share of a pair's matches that agree with a map that explains it", Between(0, 1));
    visit("contradicting_share", contradicting_share, "",
          "share of a pair's matches that agree, below which the map has it elsewhere",
          Between(0, 1));
    visit("telling_points", telling_points, "",
          "points of the map among a pair's matches, with fewer of which epipolar lines are asked",
          Between(1, 100'000));
    visit("map_error_factor", map_error_factor, "",
          "error of a map's point that agrees, over pair_error_px, before all is adjusted well",
          Above(0, 1000));
    visit("rough_plane_px", rough_plane_px, "px",
          "from the homography between two photographs, as the ground is no plane",
          Above(0, 10'000));
    visit("telling_keypoints", telling_keypoints, "",
          "key points in a cell of a photograph, to know whether they match", Between(1, 100'000));
    visit("telling_cells", telling_cells, "",
          "such cells that both photographs see, to know how far their matches spread",
          Between(1, 48));
    visit("coverage_power", coverage_power, "",
          "power of the coverage in the weight of a pair, as wrong places are held by many matches "
          "of low coverage",
          Between(0, 100));
    visit("doubtful_ratio", doubtful_ratio, "",
          "what is said against a photograph, over what is said for it, that makes it doubtful",
          Above(0, 1));
  }
  void CheckRelations() const {
    CheckOption(contradicting_share <= explained_share, "contradicting_share", contradicting_share,
                "at most explained_share");
  }
};

}  // namespace deepuav
