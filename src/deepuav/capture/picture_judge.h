#pragma once

#include <optional>

#include "deepuav/base/time.h"
#include "deepuav/image/image.h"

namespace deepuav {

enum class PictureState {
  kMoving,
  kStanding,  ///< Nothing in it moves but noise: the camera stands still, or looks at nothing.
  kFrozen,    ///< The same to the bit: it is not taken anew any more.
};

struct PictureJudgeOptions {
  double frozen_after_s = 1;    ///< The same image for so long is a frozen one.
  double standing_after_s = 5;  ///< Likewise one that changes hardly.
  double standing_grey = 1.5;   ///< By how much a thumbnail's pixels change then, in the mean.
};

/// Tells pictures that stand still or are frozen from those that move.
class PictureJudge {
 public:
  explicit PictureJudge(const PictureJudgeOptions& options) : options_(options) {}

  /// Of the next image; `arrival` grows.
  PictureState Judge(const GreyImage& image, Timestamp arrival);

 private:
  bool IsSame(const GreyImage& image) const;
  bool IsNear(const GreyImage& thumbnail) const;

  const PictureJudgeOptions options_;
  GreyImage last_, still_;  ///< `still_`: a thumbnail of the first image of those that stand still.
  Timestamp last_change_, still_since_;
};

}  // namespace deepuav
