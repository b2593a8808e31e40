#pragma once

#include <optional>
#include <string>

#include "deepuav/base/option_bounds.h"
#include "deepuav/features/extractor.h"
#include "deepuav/features/seen_size.h"
#include "deepuav/features/superpoint_network.h"
#include "deepuav/features/superpoint_postprocessing.h"

namespace deepuav {

struct SuperPointOptions {
  std::string model;
  double network_pixels = 400'000;
  double photograph_pixels = 0;
  bool reduce_soft = true;
  int keypoints = 1000;
  double threshold = 0.005;
  int faint_keypoints = 450;
  double faint_threshold = 0.001;
  int nms_radius = 4;
  int border = 4;
  bool subpixel = true;
  double subpixel_sigma = 1.0;
  double subpixel_max_offset = 1.0;
  double sigma = 1.0;
  double photograph_max_lookalikes = 0.4;
  double lookalike_similarity = 0.8;
  int distinct_candidates = 4;
  bool of_photographs = false;  ///< As OfPhotographs() gives them; no option of its own.

  void Check() const;
  /// The same for photographs, for which there is time.
  SuperPointOptions OfPhotographs() const;
  /// Of images, or photographs, no more pixels than so many are seen.
  void LimitPixels(double pixels);

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("model", model, "", "file of the SuperPoint network (.onnx or .xml)",
          NotEmpty("the file of a network"));
    visit("network_pixels", network_pixels, "px",
          "images of more pixels are reduced to about as many for the network, which then takes "
          "less time and is less precise; 0: none are",
          ZeroOr(Between(1e4, 4e8)));
    visit("photograph_pixels", photograph_pixels, "px",
          "the same of photographs that are mapped at once or looked for in a map, of images that "
          "are to tell a lens, and of those that match and train-vocab see",
          ZeroOr(Between(1e4, 4e8)));
    visit("reduce_soft", reduce_soft, "",
          "whether images of a dataset in which the network finds more key points at a half of "
          "their pixels or fewer, as of thermal cameras, are reduced to as many for it");
    visit("keypoints", keypoints, "", "key points kept in an image, the best", Between(1, 20'000));
    visit("threshold", threshold, "", "detection probability that a key point must exceed",
          Below(0, 1));
    visit("faint_keypoints", faint_keypoints, "",
          "where fewer exceed it, as by motion blur, as many are taken", Between(0, 20'000));
    visit("faint_threshold", faint_threshold, "", "detection probability that these must exceed",
          Below(0, 1));
    visit("nms_radius", nms_radius, "px",
          "a key point is the maximum within this distance along x and y; this and the following "
          "in pixels that the network sees",
          Between(0, 1000));
    visit("border", border, "px", "edge of the image without key points", Between(0, 1000));
    visit("subpixel", subpixel, "", "whether positions are found between pixels");
    visit("subpixel_sigma", subpixel_sigma, "px",
          "smoothing of the probability map for sub-pixel positions", Between(0, kSuperPointCell));
    visit("subpixel_max_offset", subpixel_max_offset, "px",
          "largest sub-pixel correction along x and y", Between(0, 1));
    visit("sigma", sigma, "px", "standard deviation of a key point's position", Above(0, 100));
    visit("photograph_max_lookalikes", photograph_max_lookalikes, "",
          "share of the key points that look like others elsewhere in the same image, as of rows "
          "of panels, above which those are kept that have fewest such; of images as those of "
          "photograph_pixels, but for train-vocab; 1: any",
          Between(0, 1));
    visit("lookalike_similarity", lookalike_similarity, "",
          "cosine similarity above which key points of an image look alike", Between(-1, 1));
    visit("distinct_candidates", distinct_candidates, "",
          "key points among which those are then chosen, faint ones too, over how many are kept",
          Between(1, 10));
  }
};

/// SuperPoint (DeTone, Malisiewicz and Rabinovich, CVPR Workshops 2018). There are no key points in
/// what SuperPointNetwork adds to an image. Lengths of the options are in pixels that the network
/// sees.
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
  /// Of its descriptors.
  int dimension() const { return network_.dimension(); }

 private:
  Features Find(const HeatMap& heat_map);
  Features Describe(const HeatMap& heat_map, const PeakOptions& peaks,
                    const DescriptorMap& map) const;
  std::optional<Keypoint> MakeKeypoint(const Eigen::Vector2f& image_px, float score) const;

  Camera camera_;
  SuperPointOptions options_;
  PeakRefiner refiner_;
  SeenSize size_;
  SuperPointNetwork network_;
  GreyImage reduced_;
};

}  // namespace deepuav
