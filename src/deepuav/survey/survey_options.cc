#include "deepuav/survey/survey_options.h"

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/options.h"

namespace deepuav {

void SurveyOptions::Check() const {
  CheckRange("survey.max_photographs", max_photographs, 0, 100000);
  CheckRange("survey.sequence_neighbours", sequence_neighbours, 0, 1000);
  CheckRange("survey.similar_neighbours", similar_neighbours, 0, 1000);
  CheckRange("survey.overlap_neighbours", overlap_neighbours, 0, 1000);
  CheckOption(min_overlap > 0 && min_overlap <= 1, "survey.min_overlap", min_overlap,
              "above 0, at most 1");
  CheckRange("survey.min_pair_matches", min_pair_matches, 8, 100000);
  CheckOption(min_pair_ratio >= 0 && min_pair_ratio <= 1, "survey.min_pair_ratio", min_pair_ratio,
              "0 to 1");
  CheckPositive("survey.pair_error_px", pair_error_px, 1000);
  CheckRange("survey.weak_pair_matches", weak_pair_matches, 0, 1000000);
  CheckRange("survey.trial_views", trial_views, 3, 1000);
  CheckRange("survey.trial_pairs", trial_pairs, 1, 10000);
  CheckRange("survey.focal_lead", focal_lead, 1, 100);
  CheckRange("survey.min_pose_inliers", min_pose_inliers, 6, 100000);
  CheckOption(min_pose_ratio >= 0 && min_pose_ratio <= 1, "survey.min_pose_ratio", min_pose_ratio,
              "0 to 1");
  CheckPositive("survey.max_error_px", max_error_px, 1000);
  CheckPositive("survey.min_parallax_deg", min_parallax_deg, 90);
  CheckRange("survey.min_map_views", min_map_views, 3, 10000);
  CheckOption(adjust_growth > 1 && adjust_growth <= 100, "survey.adjust_growth", adjust_growth,
              "above 1, at most 100");
  CheckRange("survey.window_views", window_views, 2, 1000);
  CheckPositive("survey.k1_sigma", k1_sigma, 100);
  CheckPositive("survey.k2_sigma", k2_sigma, 100);
  CheckPositive("survey.centre_sigma", centre_sigma, 1);
  CheckPositive("survey.tangential_sigma", tangential_sigma, 1);
  CheckPositive("survey.readout_sigma_s", readout_sigma_s, 10);
  CheckRange("survey.max_model_sigma_px", max_model_sigma_px, 0, 100);
  CheckPositive("survey.max_lens_sigma", max_lens_sigma, 1);
  CheckRange("survey.images_in_memory", images_in_memory, 1, 100000);
  CheckRange("survey.contradicting_matches", contradicting_matches, 8, 100000);
  CheckRange("survey.contradicting_coverage", contradicting_coverage, 0, 1);
  CheckRange("survey.suspect_coverage", suspect_coverage, 0, 1);
  CheckRange("survey.finish_rounds", finish_rounds, 1, 100);
}

}  // namespace deepuav
