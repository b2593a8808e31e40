#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "callbacks.h"
#include "deepuav/api/slam.h"

namespace deepuav::python {
namespace {

using namespace nb::literals;  // NOLINT(google-build-using-namespace): operators alone

namespace fs = std::filesystem;
using Unlocked = nb::call_guard<nb::gil_scoped_release>;
using Triple = std::array<double, 3>;

constexpr std::size_t kSide = 4;

nb::dict FrameTable(const std::vector<api::Frame>& frames) {
  std::vector<std::int64_t> ids, times;
  std::vector<std::int32_t> maps, keypoints, landmarks;
  std::vector<double> poses;
  nb::list states, reasons;
  for (const api::Frame& frame : frames) {
    ids.push_back(frame.id);
    times.push_back(frame.time_ns);
    maps.push_back(frame.map);
    keypoints.push_back(frame.keypoints);
    landmarks.push_back(frame.landmarks);
    if (frame.map >= 0) AppendMatrix(frame.world_from_camera, &poses);
    if (frame.map < 0) AppendNoMatrix(&poses);
    states.append(nb::cast(NameOf(frame.state)));
    reasons.append(nb::cast(frame.reason));
  }
  const std::size_t count = frames.size();
  nb::dict table;
  table["id"] = MakeArray(std::move(ids), count);
  table["time_ns"] = MakeArray(std::move(times), count);
  table["map"] = MakeArray(std::move(maps), count);
  table["world_from_camera"] = MakeArray(std::move(poses), count, {kSide, kSide});
  table["keypoints"] = MakeArray(std::move(keypoints), count);
  table["landmarks"] = MakeArray(std::move(landmarks), count);
  table["state"] = states;
  table["reason"] = reasons;
  return table;
}

/// What a run is made of. The interpreter's lock is not held where it waits for the run, which may
/// wait for a function of Python.
class PythonSlam {
 public:
  PythonSlam(const api::Camera& camera, const api::Options& options, api::RunSetup setup,
             std::unique_ptr<Callbacks> callbacks)
      : callbacks_(std::move(callbacks)) {
    if (callbacks_->IsHeard()) setup.observer = callbacks_.get();
    const nb::gil_scoped_release released;
    slam_.emplace(camera, options, setup);
  }
  PythonSlam(const PythonSlam&) = delete;
  PythonSlam& operator=(const PythonSlam&) = delete;
  ~PythonSlam() {
    const nb::gil_scoped_release released;
    slam_.reset();
  }

  Callbacks& callbacks() { return *callbacks_; }

  void Feed(const PixelArray& pixels, std::int64_t time_ns) {
    const api::ImageView view = ViewOf(pixels);
    const nb::gil_scoped_release released;
    slam_->Feed(view, time_ns);
  }
  void FeedImu(std::int64_t time_ns, const Triple& turn, const Triple& force) {
    slam_->FeedImu({time_ns, {turn[0], turn[1], turn[2]}, {force[0], force[1], force[2]}});
  }
  void FeedFix(std::int64_t time_ns, double latitude_deg, double longitude_deg,
               std::optional<double> altitude_m, const Triple& sigma_m) {
    slam_->FeedFix(
        {time_ns, latitude_deg, longitude_deg, altitude_m, {sigma_m[0], sigma_m[1], sigma_m[2]}});
  }
  void FeedBarometer(std::int64_t time_ns, double altitude_m) {
    slam_->FeedBarometer({time_ns, altitude_m});
  }
  api::Result Finish() {
    const nb::gil_scoped_release released;
    return slam_->Finish();
  }

 private:
  std::unique_ptr<Callbacks> callbacks_;
  std::optional<api::Slam> slam_;
};

/// As api::Run, in a thread of its own, so that this one can look for signals: what their handlers
/// raise, as KeyboardInterrupt, ends the run and is raised once that is over and written into `out`
/// (empty: nowhere). In a thread other than Python's main one there are none.
api::Result RunUnlessInterrupted(api::DatasetSetup setup, const api::Options& options,
                                 const std::string& out) {
  constexpr std::chrono::milliseconds kBetweenLooks(100);
  std::atomic<bool> stop{false};
  setup.stop = [&stop] { return stop.load(); };
  std::optional<nb::python_error> raised;
  const nb::gil_scoped_release released;
  std::future<api::Result> run =
      std::async(std::launch::async, [&] { return api::Run(setup, options); });
  while (run.wait_for(kBetweenLooks) == std::future_status::timeout) {
    if (stop) continue;
    const nb::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() == 0) continue;
    raised.emplace();
    stop = true;
  }
  try {
    api::Result result = run.get();
    if (!raised) return result;
    if (!out.empty()) result.Write(out);
  } catch (const api::Error&) {
    if (!raised) throw;  // Who is interrupted is to know that first.
  }
  throw std::move(*raised);
}

// A function that is called back often knows the variable that holds the run: without these two the
// interpreter could not give such a circle up, and would end with the run's threads at work.
int TraverseSlam(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (!nb::inst_ready(self)) return 0;
  return nb::inst_ptr<PythonSlam>(self)->callbacks().Visit(visit, arg);
}

int ClearSlam(PyObject* self) {
  if (nb::inst_ready(self)) nb::inst_ptr<PythonSlam>(self)->callbacks().Clear();
  return 0;
}

PyType_Slot collectable[] = {{Py_tp_traverse, reinterpret_cast<void*>(TraverseSlam)},
                             {Py_tp_clear, reinterpret_cast<void*>(ClearSlam)},
                             {0, nullptr}};

void BindImuSensor(nb::module_& module) {
  using Matrix = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;
  nb::class_<api::ImuSensor>(
      module, "ImuSensor", "Where an inertial sensor is, and its continuous noise; 0: not stated.")
      .def(
          "__init__",
          [](api::ImuSensor* sensor, const Matrix& camera_from_imu, double gyroscope_noise_density,
             double gyroscope_random_walk, double accelerometer_noise_density,
             double accelerometer_random_walk) {
            new (sensor) api::ImuSensor{PoseOf(camera_from_imu.data()), gyroscope_noise_density,
                                        gyroscope_random_walk, accelerometer_noise_density,
                                        accelerometer_random_walk};
          },
          "camera_from_imu"_a, "gyroscope_noise_density"_a = 0.0, "gyroscope_random_walk"_a = 0.0,
          "accelerometer_noise_density"_a = 0.0, "accelerometer_random_walk"_a = 0.0)
      .def_static(
          "load",
          [](const fs::path& camera_file, const fs::path& imu_file) {
            return api::ReadImuSensor(camera_file.string(), imu_file.string());
          },
          "camera_file"_a, "imu_file"_a, "From the sensor.yaml of EuRoC of both.")
      .def_prop_ro(
          "camera_from_imu",
          [](const api::ImuSensor& sensor) { return PoseMatrix(sensor.camera_from_imu); },
          nb::rv_policy::automatic);
}

void BindResult(nb::module_& module) {
  nb::class_<api::Result>(module, "Result", "What a run leaves behind.")
      .def_prop_ro(
          "frames", [](const api::Result& result) { return FrameTable(result.Frames()); },
          "Arrays id, time_ns, map (-1: no pose), world_from_camera (n, 4, 4; NaN without), "
          "keypoints, landmarks; "
          "lists state and reason.")
      .def_prop_ro(
          "keyframes", [](const api::Result& result) { return KeyframeTable(result.Keyframes()); },
          "Arrays id, time_ns, map, world_from_camera (n, 4, 4), and the list image.")
      .def_prop_ro(
          "landmarks", [](const api::Result& result) { return LandmarkTable(result.Landmarks()); },
          "Arrays id, map, position_world (n, 3), observations.")
      .def_prop_ro(
          "points", [](const api::Result& result) { return PointArray(result.Landmarks()); },
          nb::rv_policy::automatic, "The landmarks' positions, (n, 3).")
      .def_prop_ro("maps", &api::Result::Maps)
      .def_prop_ro("main_map", &api::Result::MainMap,
                   "The map in which most frames lie; -1: there is none.")
      .def_prop_ro("camera", &api::Result::FinalCamera)
      .def_prop_ro("failure", &api::Result::Failure, "What ended the run early; empty: nothing.")
      .def_prop_ro("summary_json", &api::Result::SummaryJson)
      .def(
          "write",
          [](const api::Result& result, const fs::path& folder) { result.Write(folder.string()); },
          "folder"_a, Unlocked(), "Writes the output folder of deepuav run, made if absent.");
}

}  // namespace

void BindSlam(nb::module_& module) {
  BindImuSensor(module);
  BindResult(module);
  nb::class_<PythonSlam>(module, "Slam", nb::type_slots(collectable),
                         "SLAM over images that are pushed. One run an instance.")
      .def(
          "__init__",
          [](PythonSlam* slam, const api::Camera& camera, const api::Options& options,
             const std::string& schedule, const std::string& map, int queue_size,
             const std::optional<api::ImuSensor>& imu, const Triple& antenna,
             double gnss_clock_sigma_s, nb::object on_frame, nb::object on_keyframe,
             nb::object on_map, nb::object on_dropped) {
            api::RunSetup setup;
            setup.schedule = schedule;
            setup.map = map;
            setup.queue_size = queue_size;
            setup.imu = imu;
            setup.gnss = {{antenna[0], antenna[1], antenna[2]}, gnss_clock_sigma_s};
            auto callbacks = std::make_unique<Callbacks>(WatchFunctions{std::move(on_frame),
                                                                        std::move(on_keyframe),
                                                                        std::move(on_map),
                                                                        {},
                                                                        std::move(on_dropped)});
            new (slam) PythonSlam(camera, options, setup, std::move(callbacks));
          },
          "camera"_a, "options"_a = api::Options(), nb::kw_only(), "schedule"_a = "threaded",
          "map"_a = "", "queue_size"_a = 4, "imu"_a = nb::none(), "antenna_camera_m"_a = Triple{},
          "gnss_clock_sigma_s"_a = 0.0, "on_frame"_a = nb::none(), "on_keyframe"_a = nb::none(),
          "on_map"_a = nb::none(), "on_dropped"_a = nb::none(),
          "imu is needed for feed_imu. on_frame, on_keyframe and on_map are called with a dict, in "
          "order, on a thread of the library's; they never hold up the run, and what they are too "
          "slow for is dropped: on_dropped is called with the number of it before what comes next.")
      .def("feed", &PythonSlam::Feed, "image"_a, "time_ns"_a,
           "Grey (height, width) or RGB (height, width, 3) bytes, copied. Waits while the queue is "
           "full, unless live.")
      .def("feed_imu", &PythonSlam::FeedImu, "time_ns"_a, "angular_velocity_rad_s"_a,
           "specific_force_m_s2"_a)
      .def("feed_fix", &PythonSlam::FeedFix, "time_ns"_a, "latitude_deg"_a, "longitude_deg"_a,
           "altitude_m"_a = nb::none(), "sigma_m"_a = Triple{})
      .def("feed_barometer", &PythonSlam::FeedBarometer, "time_ns"_a, "altitude_m"_a)
      .def("finish", &PythonSlam::Finish, "Waits for the run to end after the last image. Once.");
  module.def(
      "run_dataset",
      [](const std::string& dataset, const std::string& camera, const std::string& map,
         const std::string& schedule, const std::string& use, int start, int end, int stride,
         const api::Options& options, const std::string& out_if_interrupted, nb::object on_frame,
         nb::object on_keyframe, nb::object on_map, nb::object on_restart, nb::object on_dropped) {
        Callbacks callbacks(WatchFunctions{std::move(on_frame), std::move(on_keyframe),
                                           std::move(on_map), std::move(on_restart),
                                           std::move(on_dropped)});
        return RunUnlessInterrupted(
            {dataset, camera, map, schedule, use, start, end, stride, &callbacks}, options,
            out_if_interrupted);
      },
      "dataset"_a, "camera"_a, "map"_a, "schedule"_a, "use"_a, "start"_a, "end"_a, "stride"_a,
      "options"_a, "out_if_interrupted"_a, "on_frame"_a = nb::none(), "on_keyframe"_a = nb::none(),
      "on_map"_a = nb::none(), "on_restart"_a = nb::none(), "on_dropped"_a = nb::none());
}

}  // namespace deepuav::python
