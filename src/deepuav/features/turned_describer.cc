#include "deepuav/features/turned_describer.h"

namespace deepuav {

Eigen::Vector2f TurnPixel(const Eigen::Vector2f& px, int quarter_turns, int width, int height) {
  const auto right = static_cast<float>(width - 1), bottom = static_cast<float>(height - 1);
  switch (quarter_turns) {
    case 1:
      return {bottom - px.y(), px.x()};
    case 2:
      return {right - px.x(), bottom - px.y()};
    case 3:
      return {px.y(), right - px.x()};
    default:
      return px;
  }
}

TurnedDescriptors TurnedDescriber::Describe(const GreyImage& image, const Features& features,
                                            const QuarterTurns& turns) {
  TurnedDescriptors turned;
  for (size_t i = 0; i < turned.size(); ++i) {
    if (turns[i]) turned[i] = DescribeTurned(image, features, static_cast<int>(i) + 1);
  }
  return turned;
}

}  // namespace deepuav
