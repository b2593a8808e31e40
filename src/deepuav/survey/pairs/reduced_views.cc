#include "deepuav/survey/pairs/reduced_views.h"

#include <algorithm>
#include <map>
#include <memory>

#include "deepuav/place/place_index.h"

namespace deepuav {
namespace {

constexpr int kHeadings = 4;

/// Key points of a level of the image's pyramid in pixels of the image, as its lens sees them.
Features InWholePixels(Features features, int halvings, const Camera& camera) {
  const auto factor = static_cast<float>(1 << halvings);
  Features whole{{}, Descriptors(features.descriptors.dimension())};
  for (int i = 0; i < features.size(); ++i) {
    Keypoint keypoint = features.keypoints[static_cast<size_t>(i)];
    keypoint.image_px = ((keypoint.image_px.array() + 0.5f) * factor - 0.5f).matrix();
    const auto px = camera.Undistort(keypoint.image_px.cast<double>());
    if (!px) continue;
    keypoint.px = px->cast<float>();
    keypoint.sigma_px = factor;
    whole.keypoints.push_back(keypoint);
    whole.descriptors.AppendFrom(features.descriptors, i);
  }
  return whole;
}

void Append(const Features& more, Features* all) {
  for (int i = 0; i < more.size(); ++i) {
    all->keypoints.push_back(more.keypoints[static_cast<size_t>(i)]);
    all->descriptors.AppendFrom(more.descriptors, i);
  }
}

/// What photographs look like as they are, under every heading.
class HeadingIndex {
 public:
  HeadingIndex(const std::vector<SurveyView>& views, const std::set<int>& which,
               const Vocabulary& vocabulary) {
    for (const int v : which) {
      const SurveyView& view = views[static_cast<size_t>(v)];
      Add(v, 0, vocabulary.Words(view.FeaturesAt(0).descriptors));
      for (int turns = 1; turns < kHeadings; ++turns) {
        const StoredDescriptors& turned = view.turned[static_cast<size_t>(turns) - 1];
        if (turned.size() > 0) Add(v, turns, vocabulary.Words(turned.Load()));
      }
    }
  }

  struct Hit {
    float similarity = 0;
    int view = 0, quarter_turns = 0;  ///< Of that view.
  };

  std::vector<Hit> Query(const Descriptors& descriptors, const Vocabulary& vocabulary, int count,
                         int self) const {
    std::vector<Hit> hits;
    const auto is_self = [self](KeyframeId id) { return id.value / kHeadings == self; };
    for (const PlaceIndex::Hit& hit : index_.Query(vocabulary.Words(descriptors), count, is_self)) {
      hits.push_back({hit.similarity, static_cast<int>(hit.keyframe.value / kHeadings),
                      static_cast<int>(hit.keyframe.value % kHeadings)});
    }
    return hits;
  }

 private:
  void Add(int view, int turns, BagOfWords words) {
    index_.Add(KeyframeId{int64_t{view} * kHeadings + turns}, std::move(words));
  }

  PlaceIndex index_;
};

/// `reduced` is seen at a part of its size, `whole` turned clockwise to look like it.
PairCandidate ReducedPair(int reduced, int halvings, int whole, int quarter_turns_of_whole) {
  if (whole < reduced) return {whole, reduced, quarter_turns_of_whole, -halvings};
  return {reduced, whole, (kHeadings - quarter_turns_of_whole) % kHeadings, halvings};
}

PairCandidate BothReduced(int view, int other, int halvings) {
  return {std::min(view, other), std::max(view, other), 0, 0, halvings};
}

void AddNeighbours(int view, int count, const SurveyOptions& options,
                   std::set<PairCandidate>* pairs) {
  const int first = std::max(0, view - options.sequence_neighbours);
  const int last = std::min(count - 1, view + options.sequence_neighbours);
  for (int other = first; other <= last; ++other) {
    if (other == view) continue;
    for (int halvings = 1; halvings <= SurveyView::kMostHalvings; ++halvings) {
      pairs->insert(ReducedPair(view, halvings, other, 0));
      pairs->insert(ReducedPair(other, halvings, view, 0));
      pairs->insert(BothReduced(view, other, halvings));
    }
  }
}

/// What looks like views of `outside` when both are reduced alike.
void AddAlikeReduced(const std::vector<SurveyView>& views, const std::set<int>& outside,
                     const Vocabulary& vocabulary, const SurveyOptions& options,
                     std::set<PairCandidate>* pairs) {
  for (int halvings = 1; halvings <= SurveyView::kMostHalvings; ++halvings) {
    PlaceIndex index;
    std::map<int, BagOfWords> of_outside;
    for (size_t v = 0; v < views.size(); ++v) {
      if (views[v].Halvings() < halvings) continue;
      const int view = static_cast<int>(v);
      BagOfWords words = vocabulary.Words(views[v].FeaturesAt(halvings).descriptors);
      if (outside.contains(view)) of_outside.emplace(view, words);
      index.Add(KeyframeId{view}, std::move(words));
    }
    for (const auto& [view, words] : of_outside) {
      const auto is_self = [v = view](KeyframeId id) { return id.value == v; };
      for (const PlaceIndex::Hit& hit : index.Query(words, options.similar_neighbours, is_self))
        pairs->insert(BothReduced(view, static_cast<int>(hit.keyframe.value), halvings));
    }
  }
}

}  // namespace

void LookReduced(const Camera& camera, LenslessExtractor* extractor, SurveyView* view) {
  if (!view->HasImage() || view->features_by_halvings.size() > 1) return;
  const auto image = view->Image();
  auto all = std::make_shared<Features>(*view->frame.features);
  view->features_by_halvings = {view->frame.features};
  for (int halvings = 1; halvings <= SurveyView::kMostHalvings && halvings < image->levels();
       ++halvings) {
    auto reduced = std::make_shared<const Features>(
        InWholePixels(extractor->Extract(image->level(halvings)), halvings, camera));
    Append(*reduced, all.get());
    view->features_by_halvings.push_back(std::move(reduced));
  }
  view->frame.features = std::move(all);
}

void DescribeMissingHeadings(TurnedDescriber* describer, TemporaryFile* file, SurveyView* view) {
  if (!describer || !view->HasImage()) return;
  const auto is_there = [](const StoredDescriptors& turned) { return turned.size() > 0; };
  if (std::ranges::none_of(view->turned, is_there)) return;
  std::shared_ptr<const ImagePyramid> image;
  for (size_t i = 0; i < view->turned.size(); ++i) {
    if (is_there(view->turned[i])) continue;
    if (!image) image = view->Image();
    view->turned[i] = {
        describer->DescribeTurned(image->image(), view->FeaturesAt(0), static_cast<int>(i) + 1),
        file};
  }
}

std::vector<PairCandidate> ChooseReducedPairs(const std::vector<SurveyView>& views,
                                              const std::set<int>& outside,
                                              const Vocabulary* vocabulary,
                                              const SurveyOptions& options) {
  std::set<PairCandidate> pairs;
  const int count = static_cast<int>(views.size());
  for (const int view : outside) AddNeighbours(view, count, options, &pairs);
  if (!vocabulary) return {pairs.begin(), pairs.end()};
  AddAlikeReduced(views, outside, *vocabulary, options, &pairs);
  std::set<int> every;
  for (int v = 0; v < count; ++v) every.insert(every.end(), v);
  const HeadingIndex of_all(views, every, *vocabulary), of_outside(views, outside, *vocabulary);
  std::vector<std::vector<std::pair<float, PairCandidate>>> below(views.size());  // by view outside
  for (int v = 0; v < count; ++v) {
    const SurveyView& view = views[static_cast<size_t>(v)];
    const bool is_outside = outside.contains(v);
    for (int halvings = 1; halvings <= view.Halvings(); ++halvings) {
      const Descriptors& seen = view.FeaturesAt(halvings).descriptors;
      for (const auto& hit : (is_outside ? of_all : of_outside)
                                 .Query(seen, *vocabulary, options.similar_neighbours, v)) {
        const PairCandidate pair = ReducedPair(v, halvings, hit.view, hit.quarter_turns);
        if (is_outside) {
          pairs.insert(pair);
        } else {
          below[static_cast<size_t>(hit.view)].emplace_back(-hit.similarity, pair);
        }
      }
    }
  }
  for (auto& of_view : below) {
    std::sort(of_view.begin(), of_view.end());
    const auto most = static_cast<size_t>(options.similar_neighbours);
    for (size_t i = 0; i < of_view.size() && i < most; ++i) pairs.insert(of_view[i].second);
  }
  return {pairs.begin(), pairs.end()};
}

}  // namespace deepuav
