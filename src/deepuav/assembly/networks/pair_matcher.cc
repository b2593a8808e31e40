#include "deepuav/assembly/networks/pair_matcher.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace deepuav {
namespace {

constexpr size_t kImagesKept = 64;
constexpr int kHeadings = 4;
constexpr int kPyramidLevels = 3;

double SumOfScores(const std::vector<Match>& matches) {
  double sum = 0;
  for (const Match& match : matches) sum += match.score;
  return sum;
}

Eigen::Vector2i SizeOf(const GreyImage& image) { return {image.cols, image.rows}; }

}  // namespace

/// What is kept of an image. `turned` is empty unless headings are tried.
struct PairMatcher::SeenImage {
  std::filesystem::path file;
  ReducedImage reduced;
  std::optional<ImagePyramid> pyramid;  ///< Of it, where positions are refined.
  Features features;
  TurnedDescriptors turned;

  /// The features as they lie and look once the image is turned.
  Features Turned(int quarter_turns) const {
    if (quarter_turns == 0) return features;
    Features result{features.keypoints, turned[static_cast<size_t>(quarter_turns) - 1]};
    const GreyImage& image = reduced.image;
    for (Keypoint& keypoint : result.keypoints) {
      keypoint.image_px = TurnPixel(keypoint.image_px, quarter_turns, image.cols, image.rows);
      keypoint.px = keypoint.image_px;
    }
    return result;
  }
};

PairMatcher::PairMatcher(const RunOptions& options, int max_side_px, bool headings, bool refine)
    : max_side_px_(max_side_px),
      headings_(headings),
      refine_(refine && options.system.patches.enabled),
      patches_(options.system.patches),
      extractor_(options.features.OfPhotographs(), options.inference) {
  ShippedModels().Check(options.features.model);
  if (NeedsSuperGlue(options)) {
    ShippedModels().Check(options.superglue.model);
    // The sizes are told with each pair.
    auto superglue = std::make_unique<SuperGlueMatcher>(max_side_px, max_side_px, options.superglue,
                                                        options.inference);
    superglue_ = superglue.get();
    matcher_ = std::move(superglue);
  } else {
    matcher_ = std::make_unique<NearestNeighbourMatcher>(options.matching);
  }
}

PairMatcher::PairMatcher(PairMatcher&& other) noexcept = default;
PairMatcher::~PairMatcher() = default;

std::shared_ptr<PairMatcher::SeenImage> PairMatcher::Look(ReducedImage reduced) {
  auto image = std::make_shared<SeenImage>();
  image->reduced = std::move(reduced);
  if (refine_) image->pyramid.emplace(image->reduced.image, kPyramidLevels);
  image->features = extractor_.Extract(image->reduced.image);
  if (headings_) image->turned = extractor_.DescribeTurned(image->reduced.image, image->features);
  return image;
}

std::shared_ptr<const PairMatcher::SeenImage> PairMatcher::See(const std::filesystem::path& file) {
  const auto found = std::find_if(seen_.begin(), seen_.end(),
                                  [&](const auto& image) { return image->file == file; });
  if (found != seen_.end()) {
    seen_.splice(seen_.begin(), seen_, found);
    return seen_.front();
  }
  const auto image = Look(LoadReduced(file, max_side_px_));
  image->file = file;
  if (seen_.size() == kImagesKept) seen_.pop_back();
  seen_.push_front(image);
  return image;
}

std::vector<Match> PairMatcher::MatchHeading(const SeenImage& a, const SeenImage& b,
                                             int quarter_turns) {
  if (superglue_) {
    Eigen::Vector2i a_px = SizeOf(a.reduced.image);
    if (quarter_turns % 2 == 1) std::swap(a_px.x(), a_px.y());
    superglue_->SetImageSizes(a_px, SizeOf(b.reduced.image));
  }
  return matcher_->MatchFeatures(a.Turned(quarter_turns), b.features);
}

std::vector<PixelMatch> PairMatcher::MatchImages(const std::filesystem::path& file_a,
                                                 const std::filesystem::path& file_b) {
  const auto a = See(file_a), b = See(file_b);
  return MatchSeen(*a, *b);
}

std::vector<PixelMatch> PairMatcher::MatchImages(const GreyImage& a, const GreyImage& b) {
  const auto seen_a = Look(Reduced(a, max_side_px_)), seen_b = Look(Reduced(b, max_side_px_));
  return MatchSeen(*seen_a, *seen_b);
}

std::vector<PixelMatch> PairMatcher::MatchSeen(const SeenImage& a, const SeenImage& b) {
  std::vector<Match> best = MatchHeading(a, b, 0);
  for (int quarter_turns = 1; headings_ && quarter_turns < kHeadings; ++quarter_turns) {
    std::vector<Match> matches = MatchHeading(a, b, quarter_turns);
    if (SumOfScores(matches) > SumOfScores(best)) best = std::move(matches);
  }
  std::stable_sort(best.begin(), best.end(),
                   [](const Match& one, const Match& other) { return one.score > other.score; });
  std::vector<PointPair> pairs;
  pairs.reserve(best.size());
  for (const Match& match : best) {
    pairs.push_back({a.features.keypoints[static_cast<size_t>(match.a)].image_px.cast<double>(),
                     b.features.keypoints[static_cast<size_t>(match.b)].image_px.cast<double>()});
  }
  if (refine_) Refine(a, b, &pairs);
  std::vector<PixelMatch> found;
  found.reserve(best.size());
  for (size_t i = 0; i < best.size(); ++i) {
    found.push_back({a.reduced.ToOriginal(pairs[i].a_px.cast<float>()),
                     b.reduced.ToOriginal(pairs[i].b_px.cast<float>()),
                     // rounded descriptors can give a little more
                     std::min(best[i].score, 1.0f)});
  }
  return found;
}

void PairMatcher::Refine(const SeenImage& a, const SeenImage& b,
                         std::vector<PointPair>* pairs) const {
  const auto warps = LocalWarps(*pairs);
  for (size_t i = 0; i < pairs->size(); ++i) {
    if (!warps[i]) continue;
    PointPair& pair = (*pairs)[i];
    const auto aligned =
        AlignPatch(*a.pyramid, pair.a_px, *warps[i], *b.pyramid, pair.b_px, patches_);
    if (aligned) pair.b_px = aligned->px;
  }
}

std::string MatchesText(const std::vector<PixelMatch>& matches) {
  std::string text;
  for (const PixelMatch& match : matches) {
    fmt::format_to(std::back_inserter(text), "{:.3f} {:.3f} {:.3f} {:.3f} {:.4f}\n", match.a_px.x(),
                   match.a_px.y(), match.b_px.x(), match.b_px.y(), match.score);
  }
  return text;
}

}  // namespace deepuav
