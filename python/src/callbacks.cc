#include "callbacks.h"

#include <nanobind/stl/string.h>

#include <utility>
#include <vector>

#include "arrays.h"

namespace deepuav::python {
namespace {

std::string NameOf(api::MapChange change) {
  switch (change) {
    case api::MapChange::kStarted:
      return "started";
    case api::MapChange::kLoopClosed:
      return "loop closed";
    case api::MapChange::kMerged:
      return "merged";
    case api::MapChange::kAdjusted:
      return "adjusted";
  }
  return "";
}

nb::dict MetricOf(const api::MetricPose& pose) {
  nb::dict metric;
  metric["metric_from_camera"] = PoseMatrix(pose.metric_from_camera);
  metric["scale_sigma"] = pose.scale_sigma;
  metric["origin"] =
      pose.gauge != api::GaugeKind::kGeoreferenced
          ? nb::object(nb::none())
          : nb::object(nb::make_tuple(pose.origin_latitude_deg, pose.origin_longitude_deg,
                                      pose.origin_altitude_m));
  return metric;
}

}  // namespace

std::string NameOf(api::FrameState state) {
  switch (state) {
    case api::FrameState::kTracked:
      return "tracked";
    case api::FrameState::kLocated:
      return "located";
    case api::FrameState::kReckoned:
      return "reckoned";
    case api::FrameState::kInferred:
      return "inferred";
    case api::FrameState::kInitialising:
      return "initialising";
    case api::FrameState::kLost:
      return "lost";
  }
  return "";
}

Callbacks::Callbacks(WatchFunctions functions) : functions_(std::move(functions)) {}

Callbacks::~Callbacks() {
  const nb::gil_scoped_acquire locked;
  Clear();
}

bool Callbacks::IsHeard() const {
  const auto& [on_frame, on_keyframe, on_map, on_restart, on_dropped] = functions_;
  const auto is_there = [](const nb::object& function) {
    return function.is_valid() && !function.is_none();
  };
  return is_there(on_frame) || is_there(on_keyframe) || is_there(on_map) || is_there(on_restart) ||
         is_there(on_dropped);
}

int Callbacks::Visit(visitproc visit, void* arg) const {
  const auto& [on_frame, on_keyframe, on_map, on_restart, on_dropped] = functions_;
  for (const nb::object* function : {&on_frame, &on_keyframe, &on_map, &on_restart, &on_dropped})
    Py_VISIT(function->ptr());
  return 0;
}

void Callbacks::Clear() {
  const WatchFunctions given_up = std::exchange(functions_, {});  // To end after they are gone.
}

template <typename Tell>
void Callbacks::Call(const nb::object& to_call, const Tell& tell) {
  const nb::gil_scoped_acquire locked;
  const nb::object function = to_call;  // which Clear may take away meanwhile
  if (!function.is_valid() || function.is_none()) return;
  try {
    tell(function);
  } catch (nb::python_error& error) {
    error.restore();
    PyErr_WriteUnraisable(function.ptr());
  }
}

template <typename Fill>
void Callbacks::CallWithDict(const nb::object& to_call, const Fill& fill) {
  Call(to_call, [&](const nb::object& function) {
    nb::dict told;
    fill(told);
    function(told);
  });
}

void Callbacks::OnFrame(const api::FrameEvent& event) {
  const api::Frame& frame = event.frame;
  CallWithDict(functions_.on_frame, [&](nb::dict& told) {
    told["id"] = frame.id;
    told["time_ns"] = frame.time_ns;
    told["state"] = NameOf(frame.state);
    told["reason"] = frame.reason;
    told["map"] = frame.map;
    told["landmarks"] = frame.landmarks;
    told["world_from_camera"] =
        frame.map < 0 ? nb::object(nb::none()) : nb::cast(PoseMatrix(frame.world_from_camera));
    told["metric"] = event.metric ? nb::object(MetricOf(*event.metric)) : nb::object(nb::none());
  });
}

void Callbacks::OnKeyframe(const api::KeyframeEvent& event) {
  constexpr std::size_t kAxes = 3;
  CallWithDict(functions_.on_keyframe, [&](nb::dict& told) {
    told["id"] = event.keyframe.id;
    told["frame"] = event.frame;
    told["time_ns"] = event.keyframe.time_ns;
    told["map"] = event.keyframe.map;
    told["world_from_camera"] = PoseMatrix(event.keyframe.world_from_camera);
    std::vector<double> points;
    for (const api::Vector3& point : event.new_landmarks_world)
      points.insert(points.end(), {point.x, point.y, point.z});
    told["new_landmarks_world"] =
        MakeArray(std::move(points), event.new_landmarks_world.size(), {kAxes});
  });
}

void Callbacks::OnMap(const api::MapEvent& event) {
  CallWithDict(functions_.on_map, [&](nb::dict& told) {
    told["change"] = NameOf(event.change);
    told["map"] = event.map;
    told["into"] = event.into;
  });
}

void Callbacks::OnRestart() {
  Call(functions_.on_restart, [](const nb::object& function) { function(); });
}

void Callbacks::OnDropped(std::int64_t dropped) {
  Call(functions_.on_dropped, [=](const nb::object& function) { function(dropped); });
}

}  // namespace deepuav::python
