#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/estimation/bundle/reweighed_adjustment.h"
#include "deepuav/estimation/two_views/two_view.h"
#include "deepuav/survey/growth/joining_options.h"
#include "deepuav/survey/pairs/pair_evidence_options.h"

namespace deepuav {

/// How photographs are made a map all at once.
struct SurveyOptions {
  bool enabled = true;          ///< False: photographs are tracked one after the other, as a video.
  int max_photographs = 2000;   ///< More are tracked as a video.
  int sequence_neighbours = 3;  ///< Photographs before and after that each is matched with.
  int similar_neighbours = 12;  ///< That look most like it, under any heading.
  int position_neighbours = 6;  ///< Taken nearest to it on all sides, where that is known.
  int overlap_neighbours = 16;  ///< At the end, that the map says overlap most.
  double min_overlap = 0.25;    ///< Of the points of a photograph, seen by the other, for that.
  int min_pair_matches = 20;    ///< That agree with one epipolar geometry.
  double min_pair_ratio = 0.3;  ///< Of all matches of the pair.
  double pair_error_px = 4;     ///< From the epipolar line: the lens is not known yet.
  int weak_pair_matches = 60;   ///< Neighbours with fewer are matched by the learned matcher, too.
  int trial_views = 8;          ///< Photographs by which a start and its focal length are judged.
  int rival_views = 16;         ///< ...where those don't tell the focal length.
  int trial_pairs = 12;         ///< First pairs that are tried.
  double focal_lead = 1.02;     ///< Support of another focal length over that of the given one.
  double focal_rival_support = 0.9;  ///< Of the best start's, of one whose focal length may be it.
  double focal_agreement = 2;        ///< Of rivals, longest over shortest: else none is told.
  double held_focal_support = 0.8;   ///< Of the best start's, of one held at the given length.
  int min_pose_inliers = 20;         ///< Points that agree with the pose of a photograph.
  double min_pose_ratio = 0.25;      ///< Of those matched with it.
  double max_error_px = 3;           ///< Reprojection error of an observation that counts.
  double min_parallax_deg = 1;       ///< Of a point.
  int min_map_views = 3;             ///< A smaller map is none.
  double adjust_growth = 1.15;       ///< Growth of the map after which all of it is adjusted.
  int window_views = 12;             ///< Adjusted with a new photograph in between.
  double k1_sigma = 0.3;       ///< Of k1 before the photographs are seen, about 0 or as told...
  double k2_sigma = 0.05;      ///< ...and of k2, where the lens sees wide enough to tell it.
  double centre_sigma = 0.02;  ///< Of the principal point about the middle, over the focal length.
  double tangential_sigma = 0.01;   ///< Of p1 and p2 about none.
  double readout_sigma_s = 0.05;    ///< Of a rolling shutter's readout about none.
  double max_model_sigma_px = 0.1;  ///< Left beyond the noise of patches by a lens refined wholly.
  double max_lens_sigma = 0.005;    ///< Of a focal length that is told, over it.
  double max_whole_lens_sigma = 0.02;  ///< Of it and the principal point, all being refined.
  int patch_rounds = 2;           ///< Of measuring by patches, each on surfaces told by the last.
  double patch_noise_factor = 1;  ///< As PatchOptions::noise_factor: what is left beyond the noise
                                  ///< of pixels is estimated of all, and outliers are discarded.
  double patch_min_sigma_px = 0.01;  ///< As PatchOptions::min_sigma_px.
  double max_patch_sigmas = 4;       ///< Reprojection error of a patch's measurement, to count...
  double max_unsettled_sigmas = 10;  ///< ...and before, under a lens not right yet.
  int images_in_memory = 100;        ///< The others wait in a file for being measured in.
  int contradicting_matches = 40;    ///< Of a pair that the map puts elsewhere, at least...
  double contradicting_coverage = 0.5;  ///< ...over so much of what both see, to contradict it.
  double suspect_coverage = 0.55;       ///< Below which a pair that contradicts these may be wrong.
  PairEvidenceOptions evidence = {};
  SurveyJoiningOptions joining = {};
  TailOptions tails = {};  ///< Of what patches measured.
  int finish_rounds = 3;   ///< Of adjusting all, completing and discarding points, at most.
  int threads = 0;         ///< That adjust a map; 0: one a core. They change nothing in the result.

  void Check() const;
  void CheckRelations() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "",
          "photographs are made a map all at once; else one after the other, as a video");
    visit("max_photographs", max_photographs, "", "photographs above which they are a video, too",
          Between(0, 100000));
    visit("sequence_neighbours", sequence_neighbours, "",
          "photographs before and after that each is matched with", Between(0, 1000));
    visit("similar_neighbours", similar_neighbours, "",
          "photographs that look most like each that it is matched with", Between(0, 1000));
    visit("position_neighbours", position_neighbours, "",
          "photographs taken nearest to each, on six sides in all, that it is matched with; where "
          "position fixes are known",
          Between(0, 1000));
    visit("overlap_neighbours", overlap_neighbours, "",
          "photographs that the map says overlap, matched with each before the end",
          Between(0, 1000));
    visit("min_overlap", min_overlap, "",
          "share of a photograph's points that lie in the view of another to be matched with it",
          Above(0, 1));
    visit("min_pair_matches", min_pair_matches, "",
          "matches of a pair that agree with one epipolar geometry, at least", Between(8, 100000));
    visit("min_pair_ratio", min_pair_ratio, "", "share of a pair's matches that must agree",
          Between(0, 1));
    visit("pair_error_px", pair_error_px, "px",
          "distance from the epipolar line of a match that agrees, while the lens is unknown",
          Above(0, 1000));
    visit("weak_pair_matches", weak_pair_matches, "",
          "neighbours with fewer matches are matched by the learned matcher, too",
          Between(0, 1000000));
    visit("trial_views", trial_views, "",
          "photographs by which a start and its focal length are judged", Between(3, 1000));
    visit("rival_views", rival_views, "",
          "photographs by which they are judged where those don't tell the focal length",
          Between(3, 1000));
    visit("trial_pairs", trial_pairs, "", "first pairs of photographs that are tried",
          Between(1, 10000));
    visit("focal_lead", focal_lead, "",
          "support of another focal length over that of the given one to be taken",
          Between(1, 100));
    visit("focal_rival_support", focal_rival_support, "",
          "support of another focal length over that of the best for it to be as likely",
          Between(0, 1));
    visit("focal_agreement", focal_agreement, "",
          "longest over shortest of the focal lengths that are as likely, above which the "
          "photographs don't tell it",
          Between(1, 100));
    visit("held_focal_support", held_focal_support, "",
          "support of the given focal length, over that of the best, for it to be held where the "
          "photographs don't tell it",
          Between(0, 1));
    visit("min_pose_inliers", min_pose_inliers, "",
          "points that agree with the pose of a photograph, at least", Between(6, 100000));
    visit("min_pose_ratio", min_pose_ratio, "", "share of the points matched with it",
          Between(0, 1));
    visit("max_error_px", max_error_px, "px", "reprojection error of an observation that counts",
          Above(0, 1000));
    visit("min_parallax_deg", min_parallax_deg, "deg", "parallax of a point, at least",
          Above(0, 90));
    visit("min_map_views", min_map_views, "", "photographs of a map, at least", Between(3, 10000));
    visit("adjust_growth", adjust_growth, "", "growth of the map after which all is adjusted",
          Above(1, 100));
    visit("window_views", window_views, "", "photographs adjusted with a new one in between",
          Between(2, 1000));
    visit(
        "k1_sigma", k1_sigma, "",
        "standard deviation of the radial distortion k1 about none, or what is told of it, before "
        "it is refined",
        Above(0, 100));
    visit("k2_sigma", k2_sigma, "", "likewise of k2", Above(0, 100));
    visit(
        "centre_sigma", centre_sigma, "",
        "standard deviation of the principal point about where it is said to be, as a share of the "
        "focal length",
        Above(0, 1));
    visit("tangential_sigma", tangential_sigma, "",
          "standard deviation of the tangential distortion about none, before it is refined",
          Above(0, 1));
    visit("readout_sigma_s", readout_sigma_s, "s",
          "standard deviation of a rolling shutter's readout about none, before it is refined",
          Above(0, 10));
    visit("max_model_sigma_px", max_model_sigma_px, "px",
          "error beyond the noise of patches above which a lens with principal point, tangential "
          "distortion and readout refined is not the right model either, and not used",
          Between(0, 100));
    visit("max_lens_sigma", max_lens_sigma, "",
          "standard deviation of the focal length, as a share of it, above which the views don't "
          "tell it",
          Above(0, 1));
    visit("max_whole_lens_sigma", max_whole_lens_sigma, "",
          "standard deviation of focal length and principal point, as a share of the former, above "
          "which the views don't tell all of the lens",
          Above(0, 1));
    visit("patch_rounds", patch_rounds, "",
          "rounds of measuring points by patches, each on surfaces that the one before tells",
          Between(1, 10));
    visit("patch_noise_factor", patch_noise_factor, "",
          "of a survey's points in place of patches.noise_factor", Between(0.1, 100));
    visit("patch_min_sigma_px", patch_min_sigma_px, "px",
          "of a survey's points in place of patches.min_sigma_px", Above(0, 10));
    visit("max_patch_sigmas", max_patch_sigmas, "",
          "reprojection error of an observation measured by a patch that counts at the end, in "
          "standard deviations",
          Above(0, 1000));
    visit("max_unsettled_sigmas", max_unsettled_sigmas, "",
          "likewise while lens and poses have not settled yet", Above(0, 1000));
    visit("images_in_memory", images_in_memory, "",
          "images of photographs that stay in memory; others wait in a temporary file",
          Between(1, 100000));
    visit("contradicting_matches", contradicting_matches, "",
          "matches of two photographs that the map has at different places, for them to contradict "
          "it",
          Between(8, 100000));
    visit("contradicting_coverage", contradicting_coverage, "",
          "share of what both would see over which they must spread for that", Between(0, 1));
    visit("suspect_coverage", suspect_coverage, "",
          "share below which matches that hold one of the two where it is may be of what merely "
          "looks alike",
          Between(0, 1));
    visit.Part("evidence", evidence);
    visit.Part("joining", joining);
    visit.Part("tails", tails);
    visit("finish_rounds", finish_rounds, "",
          "rounds of adjusting all and completing its points, at most", Between(1, 100));
    visit("threads", threads, "",
          "threads that adjust a map (0: one a core), which change nothing in the result",
          Between(0, 64));
  }
};

/// At least 1.
int ThreadsOf(const SurveyOptions& options);

}  // namespace deepuav
