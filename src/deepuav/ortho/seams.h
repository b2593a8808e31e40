#pragma once

#include <opencv2/core.hpp>

#include "deepuav/base/option_bounds.h"
#include "deepuav/ortho/colour_levels.h"

namespace deepuav {

struct SeamOptions {
  double length_cost = 0.03;   ///< Of a seam between two nodes, in the unit of candidates' costs...
  double mismatch_cost = 1.5;  ///< ...and of a difference there as between black and white.
  int sweeps = 20;             ///< At most, through all nodes.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("length_cost", length_cost, "", "of a seam between two nodes", Between(0, 1e6));
    visit("mismatch_cost", mismatch_cost, "", "of a seam where one photograph is black, one white",
          Between(0, 1e6));
    visit("sweeps", sweeps, "", "through all nodes, at most", Between(0, 10000));
  }
};

/// By node: the view from which it is taken; -1 for none. Each photograph near its middle, seams
/// where the photographs agree (a Markov random field, minimised by iterated conditional modes).
cv::Mat1i ChooseSeams(const GroundGrid& grid, const ViewChoice& choice, const NodeColours& colours,
                      const ColourLevels& levels, const SeamOptions& options = {});

}  // namespace deepuav
