#pragma once

#include <array>
#include <string>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/inference/session.h"
#include "deepuav/matching/matcher.h"

namespace deepuav {

struct SuperGlueOptions {
  std::string model;
  int keypoints = 512;
  double min_score = 0.2;
  std::string precision = "fp32";

  void Check() const;  ///< All but the model, which only a matcher needs.
  void CheckModel() const;

  /// `inference` with this matcher's precision, and without a cache.
  InferenceOptions Inference(InferenceOptions inference) const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("model", model, "", "file of the network (.onnx, or OpenVINO's .xml)");
    visit("keypoints", keypoints, "", "key points of an image that are matched, the best first",
          Between(1, 10'000));
    visit("min_score", min_score, "", "least assignment probability of a match", Below(0, 1));
    visit("precision", precision, "", "arithmetic, as inference.precision; empty: that one",
          Precisions().OrEmpty());
  }
};

/// A learned matcher with the interface of SuperGlue (Sarlin et al. 2020): a network that sees
/// positions, scores and descriptors of both images at once and gives the probability that two key
/// points show the same thing.
///
/// The network (N key points of D-dimensional descriptors each; N may be open in the file):
/// - inputs `keypoints0` [1,N,2], `scores0` [1,N], `descriptors0` [1,N,D], and `keypoints1`,
/// `scores1`, `descriptors1`.
///   A key point at p in the image as taken is given as (p - size / 2) / (max(width, height) / 2).
/// - optional inputs `mask0`, `mask1` [1,N]: 1 for a key point, 0 for padding.
/// - output `assignment` [1,N,N], the probabilities, or `log_assignment`, their natural logarithms.
///
/// Images with fewer than N key points are padded: under the mask with zeros, without masks by
/// repeating the key points; a pair then has the sum over its repetitions, among which the network
/// divides the probability.
class SuperGlueMatcher : public Matcher {
 public:
  /// Images have that size in pixels, unless SetImageSizes says otherwise. Throws Error naming the
  /// file when the network has other inputs or outputs.
  SuperGlueMatcher(int width, int height, const SuperGlueOptions& options,
                   const InferenceOptions& inference);

  /// Of the images of the next pairs, which need not have one size.
  void SetImageSizes(const Eigen::Vector2i& a_px, const Eigen::Vector2i& b_px);

  /// Pairs whose probability is the largest of its row and column and at least `min_score`. Throws
  /// Error naming the file for descriptors of another dimension than the network's.
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override;
  std::string Description() const override;

 private:
  /// What the network is given of one image.
  struct Side {
    Eigen::Vector2f size_px;
    std::string keypoints_name, scores_name, descriptors_name, mask_name;
    std::vector<float> keypoints, scores, descriptors, mask;
  };

  void FixShapes();
  void FindOutput();
  void Fill(const Features& features, Side* side) const;
  /// Row-major, count_a x count_b.
  void ReadAssignment(size_t count_a, size_t count_b);

  const SuperGlueOptions options_;
  Session session_;
  size_t network_keypoints_ = 0;  ///< N
  int dimension_ = 0;             ///< D
  bool has_masks_ = false;
  std::string output_;
  bool output_is_logarithm_ = false;
  std::array<Side, 2> sides_;
  std::vector<float> assignment_;
};

}  // namespace deepuav
