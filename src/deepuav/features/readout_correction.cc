#include "deepuav/features/readout_correction.h"

namespace deepuav {

Eigen::Vector2d PixelInRow(const Keypoint& keypoint, const ReadoutMotion& motion,
                           const Camera& camera) {
  return FromMiddleRow(camera.pinhole, keypoint.px.cast<double>(),
                       RowMoment(keypoint.image_px.y(), camera.height), motion);
}

Eigen::Vector2d PixelInMiddleRow(const Keypoint& keypoint, const ReadoutMotion& motion,
                                 const Camera& camera, double inverse_depth) {
  return ToMiddleRow(camera.pinhole, PixelInRow(keypoint, motion, camera),
                     RowMoment(keypoint.image_px.y(), camera.height), motion, inverse_depth);
}

Features CorrectedForTurn(const Features& features, const ReadoutMotion& known,
                          const ReadoutMotion& motion, const Camera& camera) {
  Features corrected = features;
  for (Keypoint& keypoint : corrected.keypoints) {
    const double moment = RowMoment(keypoint.image_px.y(), camera.height);
    keypoint.px = ToMiddleRow(camera.pinhole, PixelInRow(keypoint, known, camera), moment, motion)
                      .cast<float>();
  }
  return corrected;
}

}  // namespace deepuav
