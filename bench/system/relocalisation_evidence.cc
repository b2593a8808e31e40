// How much speaks for right and for wrong poses in relocalisation: what the thresholds of
// RelocaliserOptions are chosen from.
//
//   relocalisation_evidence MAP.deepuav MAP_DATASET QUERY_DATASET MODEL.onnx
//       [start=N] [end=N] [stride=N] [turned=1] [right_m=0.3] [right_deg=10] [rows=FILE]
//       [relocalisation.NAME=VALUE ...] [matching.NAME=VALUE ...]
//
// With a lax matcher and low relocalisation.min_matches and
// relocalisation.absolute_pose.min_inliers more wrong poses come as far as being counted; those
// with fewer inliers than relocalisation.min_inliers are not.
//
// Tries frames of QUERY_DATASET in the surroundings of every keyframe of the map made of
// MAP_DATASET. Where both are one, the truth says which poses are right, after a similarity
// alignment of the map's keyframes with it; where they differ, all are wrong.

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <numbers>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/base/options.h"
#include "deepuav/base/time.h"
#include "deepuav/evaluation/measures/truth.h"
#include "deepuav/features/superpoint.h"
#include "deepuav/features/superpoint_turned.h"
#include "deepuav/geometry/alignment.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/localisation/relocaliser.h"
#include "deepuav/matching/nearest_neighbour.h"

namespace deepuav {
namespace {

struct Settings {
  int start = 0, end = 0, stride = 10;
  bool turned = false;
  double right_m = 0.3, right_deg = 10;
  std::string rows;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("start", start, "", "", Between(0, 1e9));
    visit("end", end, "", "", Between(0, 1e9));
    visit("stride", stride, "", "", Between(1, 1e9));
    visit("turned", turned, "", "");
    visit("right_m", right_m, "m", "", Between(0, 1e6));
    visit("right_deg", right_deg, "deg", "", Between(0, 180));
    visit("rows", rows, "", "");
  }
};

const TimedPose& Nearest(const Trajectory& trajectory, Timestamp time) {
  const auto after =
      std::lower_bound(trajectory.begin(), trajectory.end(), time,
                       [](const TimedPose& pose, Timestamp t) { return pose.time < t; });
  if (after == trajectory.begin()) return *after;
  const auto before = std::prev(after);
  if (after == trajectory.end()) return *before;
  return SecondsBetween(before->time, time) <= SecondsBetween(time, after->time) ? *before : *after;
}

/// Judges poses in the map by the truth.
class Judge {
 public:
  Judge(const std::string& dataset, const Map& map, const Settings& settings)
      : truth_(LoadTruth(dataset, false)), settings_(settings) {
    std::vector<Eigen::Vector3d> keyframes, truth;
    map.keyframes().ForEach([&](const Keyframe& keyframe) {
      keyframes.push_back(keyframe.cam_from_world.InverseTranslation());
      truth.push_back(Nearest(truth_.trajectory, keyframe.frame.time).world_from_cam.translation());
    });
    const auto aligned = Align(keyframes, truth, AlignmentKind::kSimilar);
    if (!aligned) throw Error("{}: the map cannot be aligned with the truth", dataset);
    truth_from_map_ = *aligned;
  }

  bool IsRight(Timestamp time, const SE3& cam_from_world) const {
    const SE3& truth = Nearest(truth_.trajectory, time).world_from_cam;
    const Eigen::Vector3d error =
        truth_from_map_ * cam_from_world.InverseTranslation() - truth.translation();
    if (!truth_.has_orientation) return error.head<2>().norm() < settings_.right_m;
    const Eigen::Quaterniond rotation =
        truth_from_map_.rotation() * cam_from_world.rotation().conjugate();
    return error.norm() < settings_.right_m &&
           rotation.angularDistance(truth.rotation()) * 180 / std::numbers::pi <
               settings_.right_deg;
  }

 private:
  const Truth truth_;
  const Settings settings_;
  Sim3 truth_from_map_;
};

struct Row {
  int frame = 0;
  KeyframeId keyframe;
  bool right = false;
  bool sure = false;
  int quarter_turns = 0;
  LocationEvidence evidence;
};

void PrintHistogram(const char* title, const std::vector<Row>& rows,
                    const std::function<double(const LocationEvidence&)>& value,
                    const std::vector<double>& edges) {
  fmt::print("\n| {} at least |", title);
  for (double edge : edges) fmt::print(" {} |", edge);
  fmt::print("\n|---|");
  for (size_t i = 0; i < edges.size(); ++i) fmt::print("---|");
  for (const bool right : {true, false}) {
    fmt::print("\n| {} |", right ? "right" : "wrong");
    for (double edge : edges) {
      fmt::print(" {} |", std::count_if(rows.begin(), rows.end(), [&](const Row& row) {
                   return row.right == right && value(row.evidence) >= edge;
                 }));
    }
  }
  fmt::print("\n");
}

void PrintSummary(const std::vector<Row>& rows, int queries, size_t candidates) {
  std::map<int, std::array<bool, 3>> by_frame;  // right pose found, sure and right, sure and wrong
  for (const Row& row : rows) {
    auto& frame = by_frame[row.frame];
    frame[0] |= row.right;
    frame[1] |= row.right && row.sure;
    frame[2] |= !row.right && row.sure;
  }
  std::array<int, 3> frames{};
  for (const auto& [frame, what] : by_frame) {
    for (size_t i = 0; i < what.size(); ++i) frames[i] += what[i];
  }
  fmt::print("{} frames in the surroundings of {} keyframes: {} poses\n", queries, candidates,
             rows.size());
  fmt::print("frames with a right pose {}, with one accepted {}, with a wrong one accepted {}\n",
             frames[0], frames[1], frames[2]);
  PrintHistogram("inliers", rows, [](const LocationEvidence& e) { return e.inliers; },
                 {0, 12, 15, 20, 25, 30, 40, 50, 70, 100, 150, 200});
  PrintHistogram("inliers over visible", rows,
                 [](const LocationEvidence& e) { return e.InlierRatio(); },
                 {0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.4});
  PrintHistogram("cells", rows, [](const LocationEvidence& e) { return e.cells; },
                 {0, 4, 6, 8, 10, 12, 15, 20, 30, 40});
}

void WriteRows(const std::string& file, const std::vector<Row>& rows) {
  std::ofstream stream(file);
  stream << "frame,keyframe,right,sure,quarter_turns,matches,agreeing,inliers,visible,cells\n";
  for (const Row& row : rows) {
    const LocationEvidence& e = row.evidence;
    stream << fmt::format("{},{},{},{},{},{},{},{},{},{}\n", row.frame, row.keyframe.value,
                          int(row.right), int(row.sure), row.quarter_turns, e.matches, e.agreeing,
                          e.inliers, e.visible, e.cells);
  }
}

/// With which a pose counts by its inliers alone.
RelocaliserOptions Lenient(RelocaliserOptions options) {
  options.min_inlier_ratio = 1e-9;
  options.min_cells = 1;
  return options;
}

void Run(const std::array<std::string, 4>& files, const std::vector<std::string>& words) {
  const auto& [map_file, map_dataset, query_dataset, model] = files;
  Settings settings;
  RelocaliserOptions options;
  NearestNeighbourOptions matching;
  OptionRegistry registry;
  registry.Add("matching", &matching);
  registry.Add("run", &settings);
  registry.Add("relocalisation", &options);
  for (const std::string& word : words) {
    const bool own = word.find('.') > word.find('=');
    registry.SetAssignment(own ? "run." + word : word);
  }

  const LoadedAtlas loaded = ReadMapFile(map_file);
  const Map& map = loaded.atlas.At(MapId{0});
  const auto dataset = OpenDataset(query_dataset);
  std::optional<Judge> judge;
  if (map_dataset == query_dataset) judge.emplace(map_dataset, map, settings);
  SuperPointOptions features;
  features.model = model;
  SuperPoint extractor(dataset->camera(), features, {});
  std::optional<SuperPointTurned> describer;
  if (settings.turned) {
    const SeenSize size(dataset->camera().width, dataset->camera().height, features.network_pixels);
    describer.emplace(size, model, InferenceOptions{});
  }
  std::vector<std::shared_ptr<const LocalMap>> candidates;
  map.keyframes().ForEach(
      [&](const Keyframe& keyframe) { candidates.push_back(MakeLocalMap(map, keyframe.id, {})); });

  NearestNeighbourMatcher matcher(matching);
  const Relocaliser judging(loaded.camera, options, {}, {&matcher}, nullptr);
  Relocaliser finding(loaded.camera, Lenient(options), {}, {&matcher}, nullptr);
  std::vector<Row> rows;
  int queries = 0;
  double seconds = 0;
  const int end = settings.end > 0 ? settings.end : dataset->size();
  for (int f = settings.start; f < end; f += settings.stride) {
    const GreyImage image = dataset->Load(f);
    const Frame frame{FrameId{f}, dataset->Time(f),
                      std::make_shared<const Features>(extractor.Extract(image))};
    std::optional<TurnedDescriptors> turned;
    if (describer) turned = describer->Describe(image, *frame.features);
    const std::span<const Descriptors> headings =
        turned ? std::span<const Descriptors>(*turned) : std::span<const Descriptors>();
    ++queries;
    for (const auto& candidate : candidates) {
      const Stopwatch locating;
      const auto found = finding.Relocalise(frame, headings, {&candidate, 1});
      seconds += locating.Seconds();
      if (!found) continue;
      const bool right = judge && judge->IsRight(frame.time, found->located.cam_from_world);
      rows.push_back({f, candidate->keyframes[static_cast<size_t>(candidate->centre)].id, right,
                      judging.IsSure(found->evidence), found->quarter_turns, found->evidence});
    }
  }
  PrintSummary(rows, queries, candidates.size());
  fmt::print("\n{:.1f} ms a candidate\n",
             1000 * seconds / std::max<double>(1, double(queries) * double(candidates.size())));
  if (!settings.rows.empty()) WriteRows(settings.rows, rows);
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  if (argc < 5) {
    std::cerr << "usage: relocalisation_evidence MAP.deepuav MAP_DATASET QUERY_DATASET MODEL.onnx "
                 "[name=value ...]\n";
    return 2;
  }
  return deepuav::RunBench("relocalisation_evidence", [&] {
    deepuav::Run({argv[1], argv[2], argv[3], argv[4]}, {argv + 5, argv + argc});
    return 0;
  });
}
