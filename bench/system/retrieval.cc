// Measures how well images find the images that show the same place by their bags of words: recall
// among the first hits, and recall at full precision of the raw score, against the truth that lies
// with a dataset.
//
//   retrieval DATASET --model NETWORK.onnx --vocabulary FILE... [--against DATASET]
//
// Every stride-th image queries all others that are more than --gap seconds away. Views that
// overlap by at least --overlap are right, by less than --noticeable wrong; what lies between
// counts as neither. Images of --against query too, and whatever they find is wrong.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <map>

#include "bench_main.h"
#include "deepuav/base/time.h"
#include "deepuav/evaluation/measures/truth.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/place/place_index.h"
#include "deepuav/place/vocabulary.h"
#include "described_views.h"
#include "view_overlap.h"

namespace deepuav {
namespace {

struct Arguments {
  std::string dataset, against;
  std::vector<std::string> vocabularies;
  ViewOptions views;
  OverlapBounds bounds;
  double gap_s = 5;
};

/// The headings that a query is tried at.
struct QueryHeadings {
  std::string name;
  std::vector<size_t> turns;  ///< Quarters.
};

/// What one query found, the best first.
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
  Relation Relate(size_t a, size_t b) const {
    return judge_.Judge(views_[a].world_from_cam, views_[b].world_from_cam);
  }
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
  return {dataset->camera(), truth.has_orientation,
          LoadViews(dataset.get(), truth.trajectory, arguments.views)};
}

void Measure(const Arguments& arguments) {
  const LoadedDataset dataset = LoadWithTruth(arguments.dataset, arguments);
  LoadedDataset other;
  if (!arguments.against.empty()) other = LoadWithTruth(arguments.against, arguments);
  const OverlapJudge judge(dataset.camera, dataset.has_orientation, arguments.bounds);
  const Measurement measurement(&dataset.views, &judge, arguments.gap_s);
  std::vector<QueryHeadings> headings = {{"as taken", {0}}};
  if (arguments.views.turned) {
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
  app.add_option("--model", arguments.views.model, "SuperPoint network")->required();
  app.add_option("--vocabulary", arguments.vocabularies, "Vocabulary files")->required();
  app.add_option("--against", arguments.against, "Dataset of another place");
  app.add_option("--stride", arguments.views.stride, "Every n-th image")->capture_default_str();
  app.add_option("--keypoints", arguments.views.keypoints, "Key points in an image")
      ->capture_default_str();
  app.add_option("--gap", arguments.gap_s, "Images closer in time are left out, s")
      ->capture_default_str();
  app.add_option("--depth", arguments.bounds.depth_m, "Usual distance of what is seen, m")
      ->capture_default_str();
  app.add_option("--overlap", arguments.bounds.same_place, "Overlap of views of the same place")
      ->capture_default_str();
  app.add_option("--noticeable", arguments.bounds.noticeable,
                 "Overlap below which places are different")
      ->capture_default_str();
  app.add_flag("--turned", arguments.views.turned, "Query also with turned images");
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
