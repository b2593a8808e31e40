// Measures how well images find the images that show the same place by their bags of words: recall
// among the first hits, and recall at full precision of the raw score, against the truth that lies
// with a dataset.
//
//   retrieval DATASET --model NETWORK.onnx --vocabulary FILE... [--against DATASET]
//
// Every stride-th image queries all others that are more than --gap seconds away.
//
// Which pairs show the same place: with true poses, those whose views overlap: of points on a grid
// over one image, at several depths, the fraction that the other sees, the smaller of both ways.
// With positions alone (photographs straight down, heading unknown) the overlap of two discs, as
// wide as the image's shorter side shows at --depth. At least --overlap is right, less than
// --noticeable is wrong; what lies between counts as neither. Images of --against query too, and
// whatever they find is wrong.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <numbers>
#include <optional>

#include "bench_main.h"
#include "deepuav/base/error.h"
#include "deepuav/base/time.h"
#include "deepuav/evaluation/truth.h"
#include "deepuav/features/superpoint.h"
#include "deepuav/features/superpoint_turned.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/place/place_index.h"
#include "deepuav/place/vocabulary.h"

namespace deepuav {
namespace {

struct Arguments {
  std::string dataset, model, against;
  std::vector<std::string> vocabularies;
  int stride = 5, keypoints = 1000;
  double gap_s = 5, depth_m = 2, overlap = 0.5, noticeable = 0.1;
  bool turned = false;
};

/// A frame's descriptors as it is, then turned by 90, 180 and 270 degrees if asked for.
using Headings = std::vector<Descriptors>;

struct View {
  Timestamp time;
  SE3 world_from_cam;
  Headings headings;
};

enum class Relation { kSamePlace, kBetween, kOtherPlace };

/// Tells how much two views share.
class OverlapJudge {
 public:
  OverlapJudge(const Camera& camera, bool has_orientation, const Arguments& arguments)
      : camera_(camera),
        has_orientation_(has_orientation),
        least_overlap_(arguments.overlap),
        least_noticeable_(arguments.noticeable),
        depth_m_(arguments.depth_m) {
    constexpr double kDepthFactors[] = {0.5, 1, 2};
    constexpr int kColumns = 12, kRows = 9;
    for (const double factor : kDepthFactors) {
      for (int i = 0; i < kColumns * kRows; ++i) {
        const Eigen::Vector2d px((i % kColumns + 0.5) * camera.width / kColumns,
                                 (i / kColumns + 0.5) * camera.height / kRows);
        points_cam_.push_back(factor * depth_m_ * camera.pinhole.Unproject(px));
      }
    }
  }

  Relation Judge(const View& a, const View& b) const {
    const double overlap =
        has_orientation_
            ? std::min(SeenBy(a.world_from_cam, b.world_from_cam),
                       SeenBy(b.world_from_cam, a.world_from_cam))
            : DiscOverlap((a.world_from_cam.translation() - b.world_from_cam.translation()).norm());
    if (overlap >= least_overlap_) return Relation::kSamePlace;
    return overlap >= least_noticeable_ ? Relation::kBetween : Relation::kOtherPlace;
  }

 private:
  /// Of what one view shows, the fraction that the other sees.
  double SeenBy(const SE3& world_from_a, const SE3& world_from_b) const {
    const SE3 b_from_a = world_from_b.Inverse() * world_from_a;
    int seen = 0;
    for (const Eigen::Vector3d& point : points_cam_) {
      const Eigen::Vector3d in_b = b_from_a * point;
      if (in_b.z() <= 0) continue;
      const Eigen::Vector2d px = camera_.pinhole.Project(in_b);
      seen += px.x() >= 0 && px.y() >= 0 && px.x() < camera_.width && px.y() < camera_.height;
    }
    return seen / static_cast<double>(points_cam_.size());
  }

  /// Of two equal discs, the fraction of one that lies in the other.
  double DiscOverlap(double distance_m) const {
    const double radius_m =
        0.5 * depth_m_ * std::min(camera_.width, camera_.height) / camera_.pinhole.fx;
    const double half = distance_m / (2 * radius_m);
    if (half >= 1) return 0;
    return 2 / std::numbers::pi * (std::acos(half) - half * std::sqrt(1 - half * half));
  }

  const Camera camera_;
  const bool has_orientation_;
  const double least_overlap_, least_noticeable_, depth_m_;
  std::vector<Eigen::Vector3d> points_cam_;
};

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

/// The frames that can be read and have a true pose.
std::vector<View> LoadViews(Dataset* dataset, const Truth& truth, const Arguments& arguments) {
  SuperPointOptions options;
  options.model = arguments.model;
  options.keypoints = arguments.keypoints;
  const Camera& camera = dataset->camera();
  SuperPoint extractor(camera, options, {});
  std::optional<SuperPointTurned> turned;
  if (arguments.turned)
    turned.emplace(camera.width, camera.height, arguments.model, InferenceOptions{});
  std::vector<View> views;
  for (int frame = 0; frame < dataset->size(); frame += arguments.stride) {
    const auto pose = PoseAt(truth.trajectory, dataset->Time(frame));
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

/// The headings that a query is tried at.
struct QueryHeadings {
  std::string name;
  std::vector<size_t> turns;  ///< Quarters.
};

/// What one query found, the best first.
struct Answer {
  std::vector<PlaceIndex::Hit> hits;
  bool has_true_pair = false;
};

/// The hits of all headings together, each image with its best score.
std::vector<PlaceIndex::Hit> QueryAll(const PlaceIndex& index, const std::vector<BagOfWords>& bags,
                                      const std::vector<size_t>& turns,
                                      const std::function<bool(KeyframeId)>& skip) {
  std::map<KeyframeId, PlaceIndex::Hit> best;
  for (const size_t turn : turns) {
    for (const PlaceIndex::Hit& hit : index.Query(bags.at(turn), index.size(), skip)) {
      const auto [found, is_new] = best.try_emplace(hit.keyframe, hit);
      if (!is_new && hit.similarity > found->second.similarity) found->second = hit;
    }
  }
  std::vector<PlaceIndex::Hit> hits;
  for (const auto& [keyframe, hit] : best) hits.push_back(hit);
  std::stable_sort(hits.begin(), hits.end(),
                   [](const auto& a, const auto& b) { return a.similarity > b.similarity; });
  return hits;
}

/// One vocabulary's words of all views.
struct Database {
  std::vector<std::vector<BagOfWords>> bags;  ///< By view and quarter turn.
  PlaceIndex index;
  double words_ms = 0;  ///< Mean time for the words of one image.
};

Database BuildDatabase(const std::vector<View>& views, const Vocabulary& vocabulary) {
  Database database;
  int images = 0;
  const Stopwatch watch;
  for (const View& view : views) {
    std::vector<BagOfWords>& bags = database.bags.emplace_back();
    for (const Descriptors& descriptors : view.headings)
      bags.push_back(vocabulary.Words(descriptors));
    images += static_cast<int>(bags.size());
  }
  database.words_ms = 1e3 * watch.Seconds() / std::max(images, 1);
  for (size_t i = 0; i < views.size(); ++i)
    database.index.Add(KeyframeId{static_cast<int64_t>(i)}, database.bags[i].front());
  return database;
}

class Measurement {
 public:
  Measurement(const std::vector<View>* views, const OverlapJudge* judge, double gap_s)
      : views_(*views), judge_(*judge), gap_s_(gap_s) {}

  /// `other_score`: the largest of the images of another place.
  void Print(const Database& database, const QueryHeadings& headings, double other_score) const {
    constexpr size_t kRanks[] = {1, 5, 10, 20};
    int queries = 0;
    int found_within[std::size(kRanks)] = {};
    double largest_false = other_score;
    std::vector<double> first_scores;  // of queries whose first hit is right
    double query_s = 0;
    for (size_t query = 0; query < views_.size(); ++query) {
      const Stopwatch watch;
      const auto hits = Hits(database, headings, query);
      query_s += watch.Seconds();
      if (const auto wrong = First(hits, query, Relation::kOtherPlace); wrong < hits.size())
        largest_false = std::max<double>(largest_false, hits[wrong].similarity);
      if (!HasTruePair(query)) continue;
      ++queries;
      const size_t right = RankAmongJudged(hits, query);
      for (size_t i = 0; i < std::size(kRanks); ++i) found_within[i] += right < kRanks[i];
      if (right == 0)
        first_scores.push_back(hits[First(hits, query, Relation::kSamePlace)].similarity);
    }
    const double query_ms = 1e3 * query_s / static_cast<double>(views_.size());
    const auto above = std::count_if(first_scores.begin(), first_scores.end(),
                                     [&](double score) { return score > largest_false; });
    const auto percent = [queries](auto count) {
      return queries > 0 ? 100.0 * static_cast<double>(count) / queries : 0.0;
    };
    fmt::print(
        "  {:<16} {} queries, recall@1 {:.1f} @5 {:.1f} @10 {:.1f} @20 {:.1f} %, at full "
        "precision {:.1f} % (score > {:.3f}); {:.2f} ms a query\n",
        headings.name, queries, percent(found_within[0]), percent(found_within[1]),
        percent(found_within[2]), percent(found_within[3]), percent(above), largest_false,
        query_ms);
  }

 private:
  Relation Relate(size_t a, size_t b) const { return judge_.Judge(views_[a], views_[b]); }
  bool WithinGap(size_t a, size_t b) const {
    return std::abs(SecondsBetween(views_[a].time, views_[b].time)) <= gap_s_;
  }

  std::vector<PlaceIndex::Hit> Hits(const Database& database, const QueryHeadings& headings,
                                    size_t query) const {
    return QueryAll(database.index, database.bags[query], headings.turns,
                    [&](KeyframeId id) { return WithinGap(query, static_cast<size_t>(id.value)); });
  }

  bool HasTruePair(size_t query) const {
    for (size_t i = 0; i < views_.size(); ++i) {
      if (!WithinGap(query, i) && Relate(query, i) == Relation::kSamePlace) return true;
    }
    return false;
  }

  /// Index of the first hit of that relation; hits.size() if there is none.
  size_t First(const std::vector<PlaceIndex::Hit>& hits, size_t query, Relation relation) const {
    const auto found = std::find_if(hits.begin(), hits.end(), [&](const PlaceIndex::Hit& hit) {
      return Relate(query, static_cast<size_t>(hit.keyframe.value)) == relation;
    });
    return static_cast<size_t>(found - hits.begin());
  }

  /// How many wrong hits come before the first right one.
  size_t RankAmongJudged(const std::vector<PlaceIndex::Hit>& hits, size_t query) const {
    const size_t right = First(hits, query, Relation::kSamePlace);
    if (right == hits.size()) return hits.size();
    return static_cast<size_t>(std::count_if(
        hits.begin(), hits.begin() + static_cast<ptrdiff_t>(right), [&](const auto& hit) {
          return Relate(query, static_cast<size_t>(hit.keyframe.value)) == Relation::kOtherPlace;
        }));
  }

  const std::vector<View>& views_;
  const OverlapJudge& judge_;
  const double gap_s_;
};

/// Prints the scores of another place's images and returns the largest.
double LargestOtherScore(const Database& database, const std::vector<View>& others,
                         const Vocabulary& vocabulary, const std::string& name) {
  if (others.empty()) return 0;
  std::vector<double> best;
  for (const View& other : others) {
    double score = 0;
    for (const Descriptors& heading : other.headings) {
      for (const auto& hit : database.index.Query(vocabulary.Words(heading), 1))
        score = std::max<double>(score, hit.similarity);
    }
    best.push_back(score);
  }
  std::sort(best.begin(), best.end());
  fmt::print("  {} images of {}: best score {:.3f} median, {:.3f} largest\n", best.size(), name,
             best[best.size() / 2], best.back());
  return best.back();
}

struct LoadedDataset {
  Camera camera;
  bool has_orientation = true;
  std::vector<View> views;
};

LoadedDataset LoadWithTruth(const std::string& path, const Arguments& arguments) {
  const auto dataset = OpenDataset(path);
  const Truth truth = LoadTruth(path, false);
  return {dataset->camera(), truth.has_orientation, LoadViews(dataset.get(), truth, arguments)};
}

void Measure(const Arguments& arguments) {
  const LoadedDataset dataset = LoadWithTruth(arguments.dataset, arguments);
  LoadedDataset other;
  if (!arguments.against.empty()) other = LoadWithTruth(arguments.against, arguments);
  const OverlapJudge judge(dataset.camera, dataset.has_orientation, arguments);
  const Measurement measurement(&dataset.views, &judge, arguments.gap_s);
  std::vector<QueryHeadings> headings = {{"as taken", {0}}};
  if (arguments.turned) {
    headings.push_back({"turned 0 180", {0, 2}});
    headings.push_back({"turned 0 .. 270", {0, 1, 2, 3}});
  }
  for (const std::string& file : arguments.vocabularies) {
    const Vocabulary vocabulary = Vocabulary::Load(file);
    const Database database = BuildDatabase(dataset.views, vocabulary);
    fmt::print("{}: {} words, {:.2f} ms for the words of an image, {} images\n", file,
               vocabulary.word_count(), database.words_ms, dataset.views.size());
    const double other_score =
        LargestOtherScore(database, other.views, vocabulary, arguments.against);
    for (const QueryHeadings& turns : headings) measurement.Print(database, turns, other_score);
    std::fflush(stdout);
  }
}

void AddArguments(CLI::App& app, Arguments& arguments) {
  app.add_option("DATASET", arguments.dataset, "Dataset with its truth")->required();
  app.add_option("--model", arguments.model, "SuperPoint network")->required();
  app.add_option("--vocabulary", arguments.vocabularies, "Vocabulary files")->required();
  app.add_option("--against", arguments.against, "Dataset of another place");
  app.add_option("--stride", arguments.stride, "Every n-th image")->capture_default_str();
  app.add_option("--keypoints", arguments.keypoints, "Key points in an image")
      ->capture_default_str();
  app.add_option("--gap", arguments.gap_s, "Images closer in time are left out, s")
      ->capture_default_str();
  app.add_option("--depth", arguments.depth_m, "Usual distance of what is seen, m")
      ->capture_default_str();
  app.add_option("--overlap", arguments.overlap, "Overlap of views of the same place")
      ->capture_default_str();
  app.add_option("--noticeable", arguments.noticeable, "Overlap below which places are different")
      ->capture_default_str();
  app.add_flag("--turned", arguments.turned, "Query also with turned images");
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  CLI::App app("Recall and precision of retrieval by bags of words", "retrieval");
  deepuav::Arguments arguments;
  deepuav::AddArguments(app, arguments);
  CLI11_PARSE(app, argc, argv);
  return deepuav::RunBench("retrieval", [&] {
    deepuav::Measure(arguments);
    return 0;
  });
}
