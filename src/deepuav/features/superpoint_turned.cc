#include "deepuav/features/superpoint_turned.h"

#include <opencv2/core.hpp>

namespace deepuav {
namespace {

constexpr std::array<cv::RotateFlags, 3> kTurns = {cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180,
                                                   cv::ROTATE_90_COUNTERCLOCKWISE};

}  // namespace

SuperPointTurned::SuperPointTurned(const SeenSize& size, const std::string& model,
                                   const InferenceOptions& inference)
    : size_(size),
      upright_(size.width(), size.height(), model, inference),
      sideways_(size.height(), size.width(), model, inference) {}

Descriptors SuperPointTurned::DescribeTurned(const GreyImage& image, const Features& features,
                                             int quarter_turns) {
  const GreyImage& seen = size_.Reduce(image, &reduced_);
  Descriptors turned(upright_.dimension());
  if (features.size() == 0) return turned;
  SuperPointNetwork& network = quarter_turns % 2 == 0 ? upright_ : sideways_;
  cv::rotate(seen, turned_, kTurns[static_cast<size_t>(quarter_turns) - 1]);
  network.Run(turned_);
  const DescriptorMap map = network.ReadDescriptors();
  std::vector<float> descriptor(static_cast<size_t>(upright_.dimension()));
  turned.Reserve(features.size());
  for (const Keypoint& keypoint : features.keypoints) {
    const Eigen::Vector2f px = size_.ToNetwork(keypoint.image_px);
    SampleDescriptor(map, TurnPixel(px, quarter_turns, size_.width(), size_.height()), descriptor);
    turned.Append(descriptor);
  }
  return turned;
}

}  // namespace deepuav
