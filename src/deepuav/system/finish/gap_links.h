#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/estimation/paths/gap_path.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/system/finish/gap_options.h"

namespace deepuav {

/// Standard deviation of where the camera is, in units of the map.
double PositionSigma(const GapPath::Pose& pose);

/// Links the frames of a stretch of the path by what two of them both show, which tells how the
/// camera turned between them.
class GapLinker {
 public:
  using FeaturesOfFrames = std::vector<std::shared_ptr<const Features>>;

  /// `matcher` must outlive it.
  GapLinker(const Camera& camera, Matcher* matcher, const GapOptions& options);

  /// Links neighbours, and frames ever farther from one another as long as both show the same, and
  /// turns the frames that are not known with the links. `start`: the path without links; `ids` and
  /// `features`, which may be null: by frame. Asked to `stop`, it leaves it at that.
  void Link(const GapPath& start, const std::vector<FrameId>& ids, const FeaturesOfFrames& features,
            const std::function<bool()>& stop, GapPathProblem* problem) const;
  /// Whether enough of a link's pairs agree with the path.
  bool Holds(const GapPathProblem& problem, const GapPath& path, size_t link) const;
  /// By step from one frame to the next: whether a link between near frames tells it, and holds.
  std::vector<uint8_t> StepsSeen(const GapPathProblem& problem, const GapPath& path) const;
  /// Takes the links away that do not hold.
  void DropDoubtful(const GapPath& path, GapPathProblem* problem) const;

 private:
  /// Room that parallax needs, between two frames of the path.
  double TolerancePx(const InverseDepth& scene, const GapPath& path, size_t a, size_t b) const;
  std::optional<Eigen::Quaterniond> LinkTwo(size_t a, size_t b, double tolerance_px, FrameId id,
                                            const FeaturesOfFrames& features,
                                            GapPathProblem* problem) const;

  const Camera camera_;
  Matcher* matcher_;
  const GapOptions options_;
};

}  // namespace deepuav
