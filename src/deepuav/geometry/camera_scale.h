#pragma once

#include "deepuav/geometry/camera.h"

namespace deepuav {

/// The camera of the same images resized to `width` x `height` pixels: their edges stay where they
/// are, so that a pixel p of the image becomes (p + 0.5) * scale - 0.5.
Camera ScaledCamera(const Camera& camera, int width, int height);

/// The camera of the images turned clockwise by 90 degrees `quarter_turns` times. Tangential
/// distortion turns with them.
Camera TurnedCamera(const Camera& camera, int quarter_turns);

}  // namespace deepuav
