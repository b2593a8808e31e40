#include "deepuav/base/error.h"
#include "deepuav/base/option_bounds.h"
#include "deepuav/system/slam.h"

namespace deepuav {
namespace {

/// Calls visit(prefix, part) for every struct of options within `options`, with the name that it is
/// registered under, and before the one that it lies in.
template <typename Options, typename Visitor>
void VisitParts(Options& options, Visitor&& visit) {
  visit("patches", options.patches);
  visit("gaps", options.gaps);
  auto& tracking = options.tracking;
  visit("tracking.visibility", tracking.locator.visibility);
  visit("tracking.projection", tracking.locator.projection);
  visit("tracking.absolute_pose", tracking.locator.absolute_pose);
  visit("tracking.motion_only", tracking.locator.motion_only);
  visit("tracking", tracking.locator);
  visit("initialiser.two_view", tracking.initialiser.two_view);
  visit("initialiser.absolute_pose", tracking.initialiser.absolute_pose);
  visit("initialiser", tracking.initialiser);
  visit("keyframes", tracking.keyframes);
  visit("tracking", tracking);
  auto& mapping = options.mapping;
  visit("mapping.reference", mapping.local_map.reference);
  visit("mapping.local_map", mapping.local_map);
  visit("mapping.model_noise", mapping.model_noise);
  visit("mapping.epipolar", mapping.creation.epipolar);
  visit("mapping.creation", mapping.creation);
  visit("mapping.fusion.visibility", mapping.fusion.visibility);
  visit("mapping.fusion.projection", mapping.fusion.projection);
  visit("mapping.fusion", mapping.fusion);
  visit("mapping.moving", mapping.moving);
  visit("mapping.local_bundle", mapping.local_bundle);
  visit("mapping.global_bundle", mapping.global_bundle);
  visit("mapping.lens", mapping.lens);
  visit("mapping", mapping);
  visit("survey", options.survey);
  auto& looping = options.looping;
  visit("looping.recogniser", looping.recogniser);
  visit("looping.relocaliser.absolute_pose", looping.relocaliser.absolute_pose);
  visit("looping.relocaliser", looping.relocaliser);
  visit("looping.verifier.place", looping.verifier.place);
  visit("looping.verifier.sim3", looping.verifier.sim3);
  visit("looping.verifier", looping.verifier);
  visit("looping.essential_graph.pose_graph", looping.essential_graph.pose_graph);
  visit("looping.essential_graph", looping.essential_graph);
  visit("looping.drift", looping.drift);
  visit("looping", looping);
  auto& sensors = options.sensors;
  visit("sensors.gnss", sensors.gnss);
  visit("sensors.barometer", sensors.barometer);
  visit("sensors.georeference", sensors.georeference);
  visit("sensors.imu", sensors.imu);
  visit("sensors", sensors);
}

}  // namespace

Schedule ParseSchedule(const std::string& name) {
  if (name == "sequential") return Schedule::kSequential;
  if (name == "threaded") return Schedule::kThreaded;
  if (name == "live") return Schedule::kLive;
  throw Error("schedule is '{}': expected sequential, threaded or live", name);
}

void SystemOptions::Check() const {
  CheckRange("system.map_delay_frames", map_delay_frames, 1, 1000);
  CheckRange("system.frames_ahead", frames_ahead, 1, 100);
  CheckRange("system.full_record_frames", full_record_frames, 0, 100'000'000);
  CheckRange("system.max_records", max_records, 0, 100'000'000);
  CheckRange("system.old_record_landmarks", old_record_landmarks, 0, 1'000'000);
  CheckOption(min_neighbour_share >= 0 && min_neighbour_share <= 1, "system.min_neighbour_share",
              min_neighbour_share, "0 to 1");
  CheckRange("system.max_unlocated_frames", max_unlocated_frames, 0, 1'000'000);
  CheckRange("system.adjustment_delay_keyframes", adjustment_delay_keyframes, 1, 1'000'000);
  CheckRange("system.end_reference_tries", end_reference_tries, 1, 100);
  CheckRange("system.max_gap_frames", max_gap_frames, 0, 1'000'000);
  CheckRange("system.turned_interval_s", turned_interval_s, 0, 1e6);
  CheckRange("system.finish_stopped_s", finish_stopped_s, 0, 3600);
  VisitParts(*this, [](const char* prefix, const auto& part) { CheckUnder(prefix, part); });
}

void RegisterOptions(SystemOptions* options, OptionRegistry* registry) {
  registry->Add("system", options);
  VisitParts(*options, [&](const char* prefix, auto& part) { registry->Add(prefix, &part); });
}

}  // namespace deepuav
