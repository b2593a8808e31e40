#pragma once

#include <string>
#include <vector>

#include "deepuav/features/superpoint_postprocessing.h"
#include "deepuav/image/image.h"
#include "deepuav/inference/session.h"

namespace deepuav {

/// A SuperPoint network for images of one size, in any of the published layouts: one input
/// [1,1,H,W] in 0..1; the detector as logits [1,65,H/8,W/8] or as a heat map [1,H,W] or [1,1,H,W]
/// of probabilities; descriptors [1,D,H/8,W/8], normalised or not. An image whose size is no
/// multiple of 8 is continued on the right and at the bottom by its last pixels, so that nothing of
/// it is lost and no pixel moves. Not thread-safe.
class SuperPointNetwork {
 public:
  /// Throws Error for a model or a layout that does not fit.
  SuperPointNetwork(int width, int height, const std::string& model,
                    const InferenceOptions& inference);

  /// Throws Error for an image of another size.
  void Run(const GreyImage& image);

  /// Of the last image, without what was added to it; valid until the next. Throws Error for values
  /// that are not finite.
  HeatMap ReadHeatMap();
  /// Of the last image with what was added to it; valid until the next.
  DescriptorMap ReadDescriptors();

  int dimension() const { return dimension_; }
  /// File, SHA-256 and precision.
  std::string Description() const;

 private:
  void FillInput(const GreyImage& image);

  const int width_, height_, padded_width_, padded_height_;  ///< px
  Session session_;
  std::string detector_output_, descriptor_output_;
  bool detector_gives_logits_ = false;
  int dimension_ = 0;
  std::vector<float> input_, heat_map_, softmax_scratch_, inverse_lengths_;
};

}  // namespace deepuav
