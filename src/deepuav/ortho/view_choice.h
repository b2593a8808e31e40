#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/ortho/ortho_view.h"
#include "deepuav/ortho/surface.h"

namespace deepuav {

struct ViewChoiceOptions {
  double border = 0.002;       ///< Of the image's diagonal that is not used at its edges.
  double max_angle_deg = 65;   ///< From straight down of a ray to the ground.
  double centre_weight = 0.6;  ///< Cost of a corner of an image against its middle...
  double angle_weight = 1;     ///< ...of a ray 45 degrees from straight down...
  double coarse_weight = 0.5;  ///< ...and of a photograph that shows half the detail.
  double hidden_cost = 10;     ///< Of a place that lies behind the surface.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("border", border, "", "of the image's diagonal that is not used at its edges",
          Between(0, 0.4));
    visit("max_angle_deg", max_angle_deg, "deg", "from straight down of a ray to the ground",
          Between(1, 89));
    visit("centre_weight", centre_weight, "", "cost of an image's corner against its middle",
          Between(0, 1e6));
    visit("angle_weight", angle_weight, "", "cost of a ray 45 degrees from straight down",
          Between(0, 1e6));
    visit("coarse_weight", coarse_weight, "", "cost of a photograph that shows half the detail",
          Between(0, 1e6));
    visit("hidden_cost", hidden_cost, "", "cost of a place that lies behind the surface",
          Between(0, 1e6));
  }
};

/// A photograph that shows a node of the surface.
struct Candidate {
  int32_t view = -1;  ///< -1: none.
  float cost = 0;     ///< Smaller is better.
  float radius2 = 0;  ///< From the image's middle over its half diagonal, squared.
};

constexpr int kMaxCandidates = 5;
using Candidates = std::array<Candidate, kMaxCandidates>;  ///< The best first; others are dropped.

struct ViewChoice {
  std::vector<Candidates> of_node;
  cv::Mat1w count;  ///< By node: photographs that see it, not hidden.
};

/// Which photographs show each node of the surface best. `gsd`: ground units that a pixel of the
/// camera shows where a photograph has all the detail that is wanted.
ViewChoice ChooseViews(const OrthoScene& scene, const Surface& surface, double gsd,
                       const ViewChoiceOptions& options = {});

/// What a pixel of the camera shows of the ground, in ground units: the median over views and the
/// points (of the world) that they show. Throws Error where they show none.
double MedianGsd(const OrthoScene& scene, const std::vector<Eigen::Vector3d>& points_world);

}  // namespace deepuav
