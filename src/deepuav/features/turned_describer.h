#pragma once

#include <array>

#include "deepuav/features/features.h"
#include "deepuav/image/image.h"

namespace deepuav {

/// Descriptors of the same key points, row i for key point i, on the image turned clockwise as
/// shown by 90, 180 and 270 degrees.
using TurnedDescriptors = std::array<Descriptors, 3>;

/// Some of these three headings.
using QuarterTurns = std::array<bool, 3>;
inline constexpr QuarterTurns kAllTurns = {true, true, true};

/// Where the pixel `px` of an image of `width` x `height` lies once the image is turned clockwise
/// by `quarter_turns` (0 to 3) times 90 degrees.
Eigen::Vector2f TurnPixel(const Eigen::Vector2f& px, int quarter_turns, int width, int height);

/// Describes key points as they look under other headings of the camera: learned descriptors stand
/// in-plane rotations of about 45 degrees only. One instance serves one camera and one thread at a
/// time.
class TurnedDescriber {
 public:
  virtual ~TurnedDescriber() = default;

  /// On the image turned clockwise by `quarter_turns` (1 to 3) times 90 degrees. `features` are of
  /// `image`, which has the camera's size; throws Error otherwise.
  virtual Descriptors DescribeTurned(const GreyImage& image, const Features& features,
                                     int quarter_turns) = 0;

  /// Under `turns`; the others are left empty.
  TurnedDescriptors Describe(const GreyImage& image, const Features& features,
                             const QuarterTurns& turns = kAllTurns);
};

}  // namespace deepuav
