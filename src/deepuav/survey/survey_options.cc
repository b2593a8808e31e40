#include "deepuav/survey/survey_options.h"

#include "deepuav/base/options.h"

namespace deepuav {

void SurveyOptions::Check() const {
  CheckOption(max_photographs >= 0, "survey.max_photographs", max_photographs, "0 or more");
  CheckOption(sequence_neighbours >= 0, "survey.sequence_neighbours", sequence_neighbours,
              "0 or more");
  CheckOption(similar_neighbours >= 0, "survey.similar_neighbours", similar_neighbours,
              "0 or more");
  CheckOption(overlap_neighbours >= 0, "survey.overlap_neighbours", overlap_neighbours,
              "0 or more");
  CheckOption(min_overlap > 0 && min_overlap <= 1, "survey.min_overlap", min_overlap,
              "above 0, at most 1");
  CheckOption(min_pair_matches >= 8, "survey.min_pair_matches", min_pair_matches, "at least 8");
  CheckOption(min_pair_ratio >= 0 && min_pair_ratio <= 1, "survey.min_pair_ratio", min_pair_ratio,
              "0 to 1");
  CheckOption(pair_error_px > 0, "survey.pair_error_px", pair_error_px, "above 0");
  CheckOption(weak_pair_matches >= 0, "survey.weak_pair_matches", weak_pair_matches, "0 or more");
  CheckOption(trial_views >= 3, "survey.trial_views", trial_views, "at least 3");
  CheckOption(trial_pairs >= 1, "survey.trial_pairs", trial_pairs, "at least 1");
  CheckOption(focal_lead >= 1, "survey.focal_lead", focal_lead, "at least 1");
  CheckOption(min_pose_inliers >= 6, "survey.min_pose_inliers", min_pose_inliers, "at least 6");
  CheckOption(min_pose_ratio >= 0 && min_pose_ratio <= 1, "survey.min_pose_ratio", min_pose_ratio,
              "0 to 1");
  CheckOption(max_error_px > 0, "survey.max_error_px", max_error_px, "above 0");
  CheckOption(min_parallax_deg > 0, "survey.min_parallax_deg", min_parallax_deg, "above 0");
  CheckOption(min_map_views >= 3, "survey.min_map_views", min_map_views, "at least 3");
  CheckOption(adjust_growth > 1, "survey.adjust_growth", adjust_growth, "above 1");
  CheckOption(window_views >= 2, "survey.window_views", window_views, "at least 2");
  CheckOption(k1_sigma > 0, "survey.k1_sigma", k1_sigma, "above 0");
  CheckOption(k2_sigma > 0, "survey.k2_sigma", k2_sigma, "above 0");
  CheckOption(finish_rounds >= 1, "survey.finish_rounds", finish_rounds, "at least 1");
}

}  // namespace deepuav
