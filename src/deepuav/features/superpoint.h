#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/features/extractor.h"
#include "deepuav/features/superpoint_postprocessing.h"
#include "deepuav/inference/session.h"

namespace deepuav {

struct SuperPointOptions {
  std::string model;
  int keypoints = 1000;
  double threshold = 0.005;
  int nms_radius = 4;
  int border = 4;
  bool subpixel = true;
  double subpixel_sigma = 1.0;
  double subpixel_max_offset = 1.0;
  double sigma = 1.0;

  void Check() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("model", model, "", "file of the SuperPoint network (.onnx or .xml)");
    visit("keypoints", keypoints, "", "key points kept in an image, the best");
    visit("threshold", threshold, "", "detection probability that a key point must exceed");
    visit("nms_radius", nms_radius, "px",
          "a key point is the maximum within this distance along x and y");
    visit("border", border, "px", "edge of the image without key points");
    visit("subpixel", subpixel, "", "whether positions are found between pixels");
    visit("subpixel_sigma", subpixel_sigma, "px",
          "smoothing of the probability map for sub-pixel positions");
    visit("subpixel_max_offset", subpixel_max_offset, "px",
          "largest sub-pixel correction along x and y");
    visit("sigma", sigma, "px",
          "standard deviation of a key point's position in the image as taken");
  }
};

/// SuperPoint (DeTone, Malisiewicz and Rabinovich, CVPR Workshops 2018) with a network in any of
/// the published layouts: one input [1,1,H,W] in 0..1; the detector as logits [1,65,H/8,W/8] or as
/// a heat map [1,H,W] or [1,1,H,W] of probabilities; descriptors [1,D,H/8,W/8], normalised or not.
/// An image whose size is no multiple of 8 is continued on the right and at the bottom by its last
/// pixels, so that nothing of it is lost and no pixel moves; there are no key points in what was
/// added.
class SuperPoint : public Extractor {
 public:
  /// Throws Error for options, a model or a layout that do not fit.
  SuperPoint(const Camera& camera, const SuperPointOptions& options,
             const InferenceOptions& inference);

  /// At most options.keypoints; those whose pixel has no undistorted one are left out. Throws Error
  /// for an image of another size than the camera's and for a network that gives values that are
  /// not finite.
  Features Extract(const GreyImage& image, ExtractionTimes* times = nullptr) override;

  std::string Description() const override;

 private:
  void FillInput(const GreyImage& image);
  HeatMap ReadHeatMap();
  Features Describe(const HeatMap& heat_map);
  std::optional<Keypoint> MakeKeypoint(const Eigen::Vector2f& image_px, float score) const;

  Camera camera_;
  SuperPointOptions options_;
  PeakRefiner refiner_;
  Session session_;
  std::string detector_output_, descriptor_output_;
  bool detector_gives_logits_ = false;
  int padded_width_, padded_height_;  ///< px
  int dimension_ = 0;
  std::vector<float> input_, heat_map_, softmax_scratch_;
};

}  // namespace deepuav
