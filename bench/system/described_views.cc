#include "described_views.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "deepuav/features/superpoint.h"
#include "deepuav/features/superpoint_turned.h"

namespace deepuav {
namespace {

std::optional<SE3> PoseAt(const Trajectory& trajectory, Timestamp time) {
  constexpr double kMaxDifference_s = 0.05;
  const auto differs_s = [time](const TimedPose& pose) {
    return std::abs(SecondsBetween(pose.time, time));
  };
  const auto nearest =
      std::min_element(trajectory.begin(), trajectory.end(),
                       [&](const auto& a, const auto& b) { return differs_s(a) < differs_s(b); });
  if (nearest == trajectory.end() || differs_s(*nearest) > kMaxDifference_s) return std::nullopt;
  return nearest->world_from_cam;
}

}  // namespace

std::vector<View> LoadViews(Dataset* dataset, const Trajectory& truth, const ViewOptions& options) {
  SuperPointOptions superpoint;
  superpoint.model = options.model;
  superpoint.keypoints = options.keypoints;
  const Camera& camera = dataset->camera();
  SuperPoint extractor(camera, superpoint, {});
  std::optional<SuperPointTurned> turned;
  if (options.turned)
    turned.emplace(SeenSize(camera.width, camera.height, superpoint.network_pixels), options.model,
                   InferenceOptions{});
  std::vector<View> views;
  for (int frame = 0; frame < dataset->size(); frame += options.stride) {
    const auto pose = PoseAt(truth, dataset->Time(frame));
    if (!pose) continue;
    const GreyImage image = dataset->Load(frame);
    const Features features = extractor.Extract(image);
    View view{dataset->Time(frame), *pose, {features.descriptors}};
    if (turned) {
      for (Descriptors& descriptors : turned->Describe(image, features))
        view.headings.push_back(std::move(descriptors));
    }
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace deepuav
