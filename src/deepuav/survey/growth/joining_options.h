#pragma once

#include "deepuav/base/option_bounds.h"

namespace deepuav {

/// How photographs beside a map are brought to it as a map of their own.
struct SurveyJoiningOptions {
  int common_views = 4;           ///< Of the map, into which one beside it grows, at most.
  int min_sights = 5;             ///< Of points of the one in the other, that agree...
  double min_ratio = 0.02;        ///< ...and their share of all such.
  double max_scale_sigma = 0.03;  ///< Standard deviation of the scale between both, over it.

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("common_views", common_views, "",
          "photographs of the map into which one beside it grows, at most", Between(1, 1000));
    visit("min_sights", min_sights, "",
          "sights of points of the one map in photographs of the other that must agree for them to "
          "be joined; those of a photograph that alone both have tell no scale and don't count",
          Between(4, 100000));
    visit("min_ratio", min_ratio, "", "share of these sights that must agree", Between(0, 1));
    visit("max_scale_sigma", max_scale_sigma, "",
          "standard deviation of the scale between two maps, as a share of it, above which they "
          "are not joined",
          Above(0, 1));
  }
};

}  // namespace deepuav
