#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/image/image.h"
#include "deepuav/simulation/rendering/render_options.h"
#include "deepuav/simulation/world/world.h"

namespace deepuav {

/// world_from_cam at any time, from half a readout and half an exposure before the first picture to
/// as much after the last, and exposure_lag_s * 3 before the first (a path that holds still there
/// will do). Called from several threads at once.
using PathOfCamera = std::function<SE3(double time_s)>;

struct Exposure {
  double start_s = 0;  ///< Of the middle row: time_s - duration_s / 2.
  double duration_s = 0;
  double gain = 1;
};

/// Which truth is rendered with a picture.
struct TruthRequest {
  bool depth = false;
  std::optional<double> flow_to_time_s;  ///< Time of the picture to which the optical flow leads.
  bool moving = false;                   ///< Which pixels show moving things.
  bool picture = true;  ///< The picture itself; without it the truth alone is rendered.
};

/// What a pixel of Rendered::moving shows.
enum MovingLevel : uint8_t {
  kStanding = 0,
  kMovingShadow = 128,  ///< Something standing, in the shadow of something that moves.
  kMoving = 255,
};

struct Rendered {
  GreyImage image;  ///< Empty unless asked for.
  Exposure exposure;
  /// Depth along the optical axis, metres, of the pixel's centre at the middle of its row's
  /// exposure; 0 where there is the sky. Empty unless asked for.
  cv::Mat1f depth_m;
  /// Displacement of what the pixel's centre shows to where it lies in the other picture, moving
  /// things with their motion; both pictures with their row times. NaN where that is outside the
  /// lens model's range or the sky. Nothing is said of occlusion: compare depths. Empty unless
  /// asked for.
  cv::Mat2f flow_px;
  /// MovingLevel of the pixel's centre at the middle of its row's exposure. Empty unless asked for.
  cv::Mat1b moving;
};

/// Renders pictures of a world. Render is a function of its arguments alone: pictures may be made
/// in any order, left out, or made again. Not thread-safe; renders on several threads itself.
class Renderer {
 public:
  /// `world` must outlive the renderer. Throws Error for options and cameras out of range. Pixels
  /// that no ray of the lens model reaches (75 degrees and more from the axis) stay black.
  Renderer(const World& world, const Camera& camera, const RenderOptions& options);
  ~Renderer();

  /// `time_s`: the middle of the exposure of the middle row, (height - 1) / 2; the written time
  /// stamp.
  Rendered Render(const PathOfCamera& world_from_cam, double time_s, int frame_index,
                  const TruthRequest& truth = {});

  /// The middle of the exposure of a row of the picture taken at `time_s`.
  double RowTime(double time_s, double row) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace deepuav
