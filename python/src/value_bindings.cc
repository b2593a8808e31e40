#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "deepuav/api/evaluate.h"
#include "deepuav/api/map.h"
#include "deepuav/api/match.h"
#include "deepuav/api/options.h"

namespace deepuav::python {
namespace {

using namespace nb::literals;  // NOLINT(google-build-using-namespace): operators alone

namespace fs = std::filesystem;
using Unlocked = nb::call_guard<nb::gil_scoped_release>;

api::LensModel LensNamed(const std::string& name) {
  if (name == "pinhole") return api::LensModel::kPinhole;
  if (name == "radial_tangential") return api::LensModel::kRadialTangential;
  if (name == "equidistant") return api::LensModel::kEquidistant;
  throw api::Error("lens '" + name + "': expected pinhole, radial_tangential or equidistant");
}

std::string NameOf(api::LensModel lens) {
  if (lens == api::LensModel::kPinhole) return "pinhole";
  return lens == api::LensModel::kEquidistant ? "equidistant" : "radial_tangential";
}

std::string NameOf(api::GaugeKind gauge) {
  if (gauge == api::GaugeKind::kFree) return "free";
  return gauge == api::GaugeKind::kMetric ? "metric" : "georeferenced";
}

void BindCamera(nb::module_& module) {
  nb::class_<api::Camera>(module, "Camera", "A calibrated camera; pixels.")
      .def(
          "__init__",
          [](api::Camera* camera, int width, int height, double fx, double fy, double cx, double cy,
             const std::string& lens, const std::vector<double>& distortion, double rate_hz,
             double readout_s) {
            new (camera) api::Camera{width, height,          fx,         fy,      cx,
                                     cy,    LensNamed(lens), distortion, rate_hz, readout_s};
          },
          "width"_a, "height"_a, "fx"_a, "fy"_a, "cx"_a, "cy"_a, "lens"_a = "pinhole",
          "distortion"_a = std::vector<double>(), "rate_hz"_a = 0.0, "readout_s"_a = 0.0)
      .def_static(
          "load", [](const fs::path& file) { return api::ReadCamera(file.string()); }, "file"_a,
          Unlocked(), "From a camera.yaml, or a camera's sensor.yaml of EuRoC.")
      .def_rw("width", &api::Camera::width)
      .def_rw("height", &api::Camera::height)
      .def_rw("fx", &api::Camera::fx)
      .def_rw("fy", &api::Camera::fy)
      .def_rw("cx", &api::Camera::cx)
      .def_rw("cy", &api::Camera::cy)
      .def_rw("distortion", &api::Camera::distortion)
      .def_rw("rate_hz", &api::Camera::rate_hz)
      .def_rw("readout_s", &api::Camera::readout_s)
      .def_prop_ro("lens", [](const api::Camera& camera) { return NameOf(camera.lens); });
}

void BindMap(nb::module_& module) {
  nb::class_<api::MapInfo>(module, "MapInfo", "One of the maps of a run or a file.")
      .def_ro("id", &api::MapInfo::id)
      .def_ro("keyframes", &api::MapInfo::keyframes)
      .def_ro("landmarks", &api::MapInfo::landmarks)
      .def_ro("scale_sigma", &api::MapInfo::scale_sigma)
      .def_ro("origin_latitude_deg", &api::MapInfo::origin_latitude_deg)
      .def_ro("origin_longitude_deg", &api::MapInfo::origin_longitude_deg)
      .def_ro("origin_altitude_m", &api::MapInfo::origin_altitude_m)
      .def_prop_ro("gauge", [](const api::MapInfo& map) { return NameOf(map.gauge); });
  nb::class_<api::Map>(module, "Map", "The maps of a map.deepuav file.")
      .def_static(
          "load", [](const fs::path& file) { return api::Map::Load(file.string()); }, "file"_a,
          Unlocked())
      .def_prop_ro("maps", &api::Map::Maps)
      .def_prop_ro("camera", &api::Map::MapCamera)
      .def_prop_ro(
          "keyframes", [](const api::Map& map) { return KeyframeTable(map.Keyframes()); },
          "Arrays id, time_ns, map, world_from_camera (n, 4, 4), and the list image.")
      .def_prop_ro(
          "landmarks", [](const api::Map& map) { return LandmarkTable(map.Landmarks()); },
          "Arrays id, map, position_world (n, 3), observations.")
      .def_prop_ro(
          "points", [](const api::Map& map) { return PointArray(map.Landmarks()); },
          nb::rv_policy::automatic, "The landmarks' positions, (n, 3).");
}

void BindOptions(nb::module_& module) {
  nb::class_<api::Options>(module, "Options", "The options of a run, as of deepuav run --set.")
      .def(nb::init<>())
      .def("set", &api::Options::Set, "name"_a, "value"_a)
      .def(
          "load", [](api::Options& options, const fs::path& file) { options.Load(file.string()); },
          "file"_a, Unlocked(), "Sets what a YAML file of options says.")
      .def(
          "values",
          [](const api::Options& options) {
            nb::list rows;
            for (const api::OptionValue& option : options.List()) {
              rows.append(nb::make_tuple(option.name, option.value, option.unit, option.meaning));
            }
            return rows;
          },
          "(name, value, unit, meaning) of every option.");
}

nb::ndarray<nb::numpy, double> MatchTable(const std::vector<api::PointMatch>& matches) {
  constexpr std::size_t kColumns = 5;
  std::vector<double> numbers;
  for (const api::PointMatch& match : matches)
    numbers.insert(numbers.end(), {match.ax, match.ay, match.bx, match.by, match.score});
  return MakeArray(std::move(numbers), matches.size(), {kColumns});
}

/// Several threads take turns.
class SharedMatcher {
 public:
  SharedMatcher(const api::Options& options, const api::MatchSetup& setup)
      : matcher_(options, setup) {}

  template <typename Image>
  std::vector<api::PointMatch> Match(const Image& a, const Image& b) {
    const nb::gil_scoped_release released;  // First: who waits for a turn holds up no one else.
    const std::scoped_lock turn(mutex_);
    return matcher_.Match(a, b);
  }

 private:
  api::Matcher matcher_;
  std::mutex mutex_;
};

void BindMatcher(nb::module_& module) {
  nb::class_<SharedMatcher>(
      module, "Matcher",
      "Matches pairs of images; keeps its networks. Several threads may use one, which take turns.")
      .def(
          "__init__",
          [](SharedMatcher* matcher, const api::Options& options, int max_side_px, bool headings,
             bool refine) {
            const nb::gil_scoped_release released;
            new (matcher) SharedMatcher(options, {max_side_px, headings, refine});
          },
          "options"_a = api::Options(), "max_side_px"_a = 640, "headings"_a = false,
          "refine"_a = true)
      .def(
          "match",
          [](SharedMatcher& matcher, const PixelArray& a, const PixelArray& b) {
            return MatchTable(matcher.Match(ViewOf(a), ViewOf(b)));
          },
          "a"_a, "b"_a, "Rows of ax, ay, bx, by, score.")
      .def(
          "match_files",
          [](SharedMatcher& matcher, const std::string& a, const std::string& b) {
            return MatchTable(matcher.Match(a, b));
          },
          "a"_a, "b"_a);
}

void BindEvaluation(nb::module_& module) {
  nb::class_<api::ErrorStatistics>(module, "Statistics")
      .def_ro("rmse", &api::ErrorStatistics::rmse)
      .def_ro("mean", &api::ErrorStatistics::mean)
      .def_ro("median", &api::ErrorStatistics::median)
      .def_ro("max", &api::ErrorStatistics::max);
  nb::class_<api::EvaluationResult>(module, "Evaluation",
                                    "How well an estimate agrees with the truth.")
      .def_ro("pairs", &api::EvaluationResult::pairs, "Poses compared.")
      .def_ro("ate_m", &api::EvaluationResult::ate_m, "Absolute error after alignment.")
      .def_ro("rpe_m", &api::EvaluationResult::rpe_m, "Relative error a step.")
      .def_ro("scale", &api::EvaluationResult::scale, "That the estimate was multiplied by.")
      .def_ro("completeness", &api::EvaluationResult::completeness,
              "Share of the truth's poses that have an estimate.")
      .def_ro("json", &api::EvaluationResult::json, "All figures.");
  module.def(
      "evaluate_files",
      [](const std::string& truth, const std::string& estimate, const std::string& align,
         double max_difference_s, double time_offset_s, double rpe_delta,
         const std::string& rpe_unit) {
        return api::Evaluate(truth, estimate,
                             {align, max_difference_s, time_offset_s, rpe_delta, rpe_unit});
      },
      "truth"_a, "estimate"_a, "align"_a, "max_difference_s"_a, "time_offset_s"_a, "rpe_delta"_a,
      "rpe_unit"_a, Unlocked());
  module.def(
      "evaluate_poses",
      [](const TimeArray& truth_times, const PoseArray& truth, const TimeArray& times,
         const PoseArray& poses, const std::string& align, double max_difference_s,
         double time_offset_s, double rpe_delta, const std::string& rpe_unit) {
        return api::Evaluate(PosesOf(truth_times, truth), PosesOf(times, poses),
                             {align, max_difference_s, time_offset_s, rpe_delta, rpe_unit});
      },
      "truth_times_ns"_a, "truth"_a, "times_ns"_a, "poses"_a, "align"_a, "max_difference_s"_a,
      "time_offset_s"_a, "rpe_delta"_a, "rpe_unit"_a, Unlocked());
}

}  // namespace

void BindValues(nb::module_& module) {
  BindCamera(module);
  BindMap(module);
  BindOptions(module);
  BindMatcher(module);
  BindEvaluation(module);
}

}  // namespace deepuav::python
