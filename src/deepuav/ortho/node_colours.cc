#include "deepuav/ortho/node_colours.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr int kFewestPixels = 64;  // of a reduced photograph's width

/// Of the camera's images, reduced to pixels that show `step` each.
cv::Size ReducedSize(const Camera& camera, double gsd, double step) {
  const double scale =
      std::clamp(gsd / step, std::min(1.0, 1.0 * kFewestPixels / camera.width), 1.0);
  return {std::max(1, static_cast<int>(std::lround(scale * camera.width))),
          std::max(1, static_cast<int>(std::lround(scale * camera.height)))};
}

struct Place {
  int column, row, slot;
};

std::vector<std::vector<Place>> PlacesOfViews(const OrthoScene& scene, const GroundGrid& grid,
                                              const ViewChoice& choice) {
  std::vector<std::vector<Place>> places(scene.views.size());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Candidates& candidates = choice.of_node[grid.Index(column, row)];
      for (int slot = 0; slot < kMaxCandidates; ++slot) {
        const int view = candidates[static_cast<size_t>(slot)].view;
        if (view >= 0) places[static_cast<size_t>(view)].push_back({column, row, slot});
      }
    }
  }
  return places;
}

/// Closes the gaps that removed candidates left.
void Compact(Candidates* candidates, std::array<cv::Vec3b, kMaxCandidates>* colours) {
  size_t kept = 0;
  for (size_t slot = 0; slot < kMaxCandidates; ++slot) {
    if ((*candidates)[slot].view < 0) continue;
    std::swap((*candidates)[kept], (*candidates)[slot]);
    std::swap((*colours)[kept], (*colours)[slot]);
    ++kept;
  }
}

}  // namespace

NodeColours ReadNodeColours(
    const OrthoScene& scene, const Surface& surface, Photographs* photographs, double gsd,
    ViewChoice* choice, const std::function<void(int view, const std::string& why)>& unreadable) {
  const cv::Size size = ReducedSize(scene.camera, gsd, surface.grid.step);
  const double scale_x = 1.0 * size.width / scene.camera.width;
  const double scale_y = 1.0 * size.height / scene.camera.height;
  NodeColours colours(surface.grid.size());
  const std::vector<std::vector<Place>> places = PlacesOfViews(scene, surface.grid, *choice);
  for (size_t i = 0; i < places.size(); ++i) {
    if (places[i].empty()) continue;
    cv::Mat3b photograph;
    try {
      photograph = photographs->Load(static_cast<int>(i), size);
    } catch (const Error& error) {
      unreadable(static_cast<int>(i), error.what());
    }
    for (const Place& place : places[i]) {
      const size_t node = surface.grid.Index(place.column, place.row);
      const auto slot = static_cast<size_t>(place.slot);
      const Eigen::Vector3d world =
          scene.frame.world_from_ground(surface.Node(place.column, place.row));
      const auto seen = Look(scene.camera, scene.views[i], world);
      const int x = seen ? cvRound((seen->px.x() + 0.5) * scale_x - 0.5) : -1;
      const int y = seen ? cvRound((seen->px.y() + 0.5) * scale_y - 0.5) : -1;
      if (y < 0 || y >= photograph.rows || x < 0 || x >= photograph.cols) {
        choice->of_node[node][slot].view = -1;
      } else {
        colours[node][slot] = photograph(y, x);
      }
    }
  }
  for (size_t node = 0; node < colours.size(); ++node)
    Compact(&choice->of_node[node], &colours[node]);
  return colours;
}

}  // namespace deepuav
