#include "deepuav/features/superpoint_turned.h"

#include <opencv2/core.hpp>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr std::array<cv::RotateFlags, 3> kTurns = {cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180,
                                                   cv::ROTATE_90_COUNTERCLOCKWISE};

}  // namespace

SuperPointTurned::SuperPointTurned(int width, int height, const std::string& model,
                                   const InferenceOptions& inference)
    : width_(width),
      height_(height),
      upright_(width, height, model, inference),
      sideways_(height, width, model, inference) {}

Descriptors SuperPointTurned::DescribeTurned(const GreyImage& image, const Features& features,
                                             int quarter_turns) {
  if (image.cols != width_ || image.rows != height_) {
    throw Error("the image has {}x{} pixels: expected the camera's {}x{}", image.cols, image.rows,
                width_, height_);
  }
  Descriptors turned(upright_.dimension());
  if (features.size() == 0) return turned;
  SuperPointNetwork& network = quarter_turns % 2 == 0 ? upright_ : sideways_;
  cv::rotate(image, turned_, kTurns[static_cast<size_t>(quarter_turns) - 1]);
  network.Run(turned_);
  const DescriptorMap map = network.ReadDescriptors();
  std::vector<float> descriptor(static_cast<size_t>(upright_.dimension()));
  turned.Reserve(features.size());
  for (const Keypoint& keypoint : features.keypoints) {
    SampleDescriptor(map, TurnPixel(keypoint.image_px, quarter_turns, width_, height_), descriptor);
    turned.Append(descriptor);
  }
  return turned;
}

}  // namespace deepuav
