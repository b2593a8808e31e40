#include "deepuav/capture/picture_judge.h"

#include <cstring>
#include <opencv2/imgproc.hpp>

namespace deepuav {

bool PictureJudge::IsSame(const GreyImage& image) const {
  if (image.size() != last_.size()) return false;
  for (int y = 0; y < image.rows; ++y) {
    if (std::memcmp(image.ptr(y), last_.ptr(y), static_cast<size_t>(image.cols)) != 0) return false;
  }
  return true;
}

bool PictureJudge::IsNear(const GreyImage& thumbnail) const {
  if (still_.empty()) return false;
  return cv::norm(thumbnail, still_, cv::NORM_L1) <
         options_.standing_grey * static_cast<double>(thumbnail.total());
}

PictureState PictureJudge::Judge(const GreyImage& image, Timestamp arrival) {
  if (!IsSame(image)) last_change_ = arrival;
  last_ = image;
  // Small enough that noise averages out, large enough that slow flight moves it.
  constexpr int kWidth = 64, kHeight = 48;
  GreyImage thumbnail;
  cv::resize(image, thumbnail, cv::Size(kWidth, kHeight), 0, 0, cv::INTER_AREA);
  if (!IsNear(thumbnail)) {
    still_ = thumbnail;
    still_since_ = arrival;
  }
  if (SecondsBetween(last_change_, arrival) >= options_.frozen_after_s)
    return PictureState::kFrozen;
  return SecondsBetween(still_since_, arrival) >= options_.standing_after_s
             ? PictureState::kStanding
             : PictureState::kMoving;
}

}  // namespace deepuav
