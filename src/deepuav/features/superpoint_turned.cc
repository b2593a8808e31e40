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

TurnedDescriptors SuperPointTurned::Describe(const GreyImage& image, const Features& features) {
  if (image.cols != width_ || image.rows != height_) {
    throw Error("the image has {}x{} pixels: expected the camera's {}x{}", image.cols, image.rows,
                width_, height_);
  }
  TurnedDescriptors turned;
  std::vector<float> descriptor(static_cast<size_t>(upright_.dimension()));
  for (size_t i = 0; i < kTurns.size(); ++i) {
    turned[i] = Descriptors(upright_.dimension());
    if (features.size() == 0) continue;
    const int quarter_turns = static_cast<int>(i) + 1;
    SuperPointNetwork& network = quarter_turns % 2 == 0 ? upright_ : sideways_;
    cv::rotate(image, turned_, kTurns[i]);
    network.Run(turned_);
    const DescriptorMap map = network.ReadDescriptors();
    turned[i].Reserve(features.size());
    for (const Keypoint& keypoint : features.keypoints) {
      SampleDescriptor(map, TurnPixel(keypoint.image_px, quarter_turns, width_, height_),
                       descriptor);
      turned[i].Append(descriptor);
    }
  }
  return turned;
}

}  // namespace deepuav
