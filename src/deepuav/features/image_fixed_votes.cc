#include "deepuav/features/image_fixed_votes.h"

#include <algorithm>
#include <utility>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

Features PlacesOf(const Features& features) {
  Features places;
  places.keypoints = features.keypoints;
  for (Keypoint& keypoint : places.keypoints) keypoint.px = keypoint.image_px;
  return places;
}

}  // namespace

void ImageFixedOptions::Check() const { CheckOptions("image_fixed", *this); }

KeypointPlaces::KeypointPlaces(std::shared_ptr<const Features> features)
    : features_(std::move(features)), places_(PlacesOf(*features_)), grid_(places_) {}

bool KeypointPlaces::HasThere(const Features& features, int keypoint,
                              const ImageFixedOptions& options) const {
  const Eigen::Vector2f& place = features.keypoints[static_cast<size_t>(keypoint)].image_px;
  std::vector<int> found;
  grid_.Find(place.cast<double>(), options.max_shift_px, &found);
  return std::ranges::any_of(found, [&](int other) {
    return features.descriptors.Similarity(keypoint, features_->descriptors, other) >=
           options.min_similarity;
  });
}

ImageFixedVotes::ImageFixedVotes(int width_px, int height_px, const ImageFixedOptions& options)
    : options_((options.Check(), options)),
      blank_(width_px, height_px, options.cell_px),
      votes_(static_cast<size_t>(blank_.columns()) * static_cast<size_t>(blank_.rows())) {}

void ImageFixedVotes::Count(const std::vector<int>& telling, const std::vector<int>& fixed) {
  const auto most = options_.max_image_share * static_cast<double>(telling.size());
  if (static_cast<double>(fixed.size()) > most) return;
  for (const int cell : telling) {
    Votes& votes = votes_[static_cast<size_t>(cell)];
    votes.all += 1;
    if (votes.all > static_cast<float>(options_.remembered_votes))
      votes = {votes.fixed / 2, votes.all / 2};
  }
  for (const int cell : fixed) votes_[static_cast<size_t>(cell)].fixed += 1;
}

ImageRegion ImageFixedVotes::Region() const {
  ImageRegion region = blank_;
  for (size_t cell = 0; cell < votes_.size(); ++cell) {
    const Votes& votes = votes_[cell];
    if (votes.fixed >= static_cast<float>(options_.min_votes) &&
        votes.fixed >= static_cast<float>(options_.min_share) * votes.all)
      region.AddAround(static_cast<int>(cell));
  }
  return region;
}

ImageRegion FixedInPhotographs(const std::vector<std::shared_ptr<const Features>>& photographs,
                               int width_px, int height_px, const ImageFixedOptions& options) {
  ImageFixedVotes votes(width_px, height_px, options);
  if (!options.set_aside) return votes.blank();
  std::vector<std::unique_ptr<const KeypointPlaces>> places;
  for (const auto& features : photographs)
    places.push_back(std::make_unique<const KeypointPlaces>(features));
  const size_t count = places.size();
  const size_t compared = std::min(count, static_cast<size_t>(options.compared_photographs) + 1);
  for (size_t i = 0; i < count; ++i) {
    // Spread over all, as neighbours may be of one place.
    for (size_t k = 1; k < compared; ++k) {
      const KeypointPlaces& other = *places[(i + k * count / compared) % count];
      std::vector<int> telling, fixed;
      for (int point = 0; point < photographs[i]->size(); ++point) {
        const int cell =
            votes.blank().CellOf(photographs[i]->keypoints[static_cast<size_t>(point)].image_px);
        telling.push_back(cell);
        if (other.HasThere(*photographs[i], point, options)) fixed.push_back(cell);
      }
      votes.Count(telling, fixed);
    }
  }
  return votes.Region();
}

}  // namespace deepuav
