#pragma once

#include <string>

#include "deepuav/features/seen_size.h"
#include "deepuav/features/superpoint_network.h"
#include "deepuav/features/turned_describer.h"

namespace deepuav {

/// TurnedDescriber with a SuperPoint network, on sessions of its own, so that it can work beside
/// the extractor in another thread.
class SuperPointTurned : public TurnedDescriber {
 public:
  /// Throws Error for a model or a layout that does not fit.
  SuperPointTurned(const SeenSize& size, const std::string& model,
                   const InferenceOptions& inference);

  /// Descriptors are of the network's dimension. Throws Error for an image of another size and for
  /// a network that gives values that are not finite.
  Descriptors DescribeTurned(const GreyImage& image, const Features& features,
                             int quarter_turns) override;

 private:
  const SeenSize size_;
  SuperPointNetwork upright_, sideways_;
  GreyImage reduced_, turned_;
};

}  // namespace deepuav
