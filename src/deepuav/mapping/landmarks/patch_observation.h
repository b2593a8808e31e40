#pragma once

#include <optional>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/map/map.h"
#include "deepuav/map/reference_view.h"
#include "deepuav/patches/patch_measurement.h"
#include "deepuav/patches/surface_normals.h"

namespace deepuav {

/// Measures landmarks in keyframes by aligning patches of their images. Thread-compatible; keeps
/// nothing.
class PatchObserver {
 public:
  PatchObserver(const Camera& camera, const PatchOptions& options,
                const ReferenceViewOptions& reference, const SurfaceNormalOptions& surface = {})
      : camera_(camera), options_(options), reference_(reference), surface_(surface) {}

  /// Where the keyframe shows the landmark at its key point, by the patch of another that sees it.
  /// Nothing where the patches do not tell.
  std::optional<PixelMeasurement> Measure(const Map& map, const Landmark& landmark,
                                          KeyframeId keyframe, int keypoint) const;

  /// Where `keyframe` shows at its key point what `reference` shows at another and what lies at
  /// `position_world`. That key point is then the patch's middle by definition.
  std::optional<PixelMeasurement> MeasurePair(const Keyframe& reference, int reference_keypoint,
                                              const Eigen::Vector3d& position_world,
                                              const Keyframe& keyframe, int keypoint) const;

  /// What MeasurePair takes `reference_keypoint` for. Nothing where no patch can be taken.
  std::optional<PixelMeasurement> ReferenceMeasurement(const Keyframe& reference, int keypoint,
                                                       const Eigen::Vector3d& position_world) const;

  /// Adds the observation where the map allows it, measured where patches tell. Returns whether.
  bool AddObservation(Map* map, KeyframeId keyframe, int keypoint, LandmarkId landmark) const;

  /// Renews the normals of all landmarks that the keyframe sees.
  void UpdateNormals(KeyframeId keyframe, Map* map) const;

  /// Measures what sees each landmark of the map by the one view that most resembles the others, so
  /// that nothing is left of errors added up from view to view, on the surface as that view shows
  /// it. For poses that are as good as they get before the last adjustment.
  void RemeasureAll(Map* map) const;

  /// As Map::MergeLandmark; what `from` was seen by is measured by the patches of `into`.
  void Merge(Map* map, LandmarkId from, LandmarkId into) const;

 private:
  void UpdateNormals(KeyframeId keyframe, const std::vector<LandmarkId>& landmarks, Map* map) const;
  void Remeasure(const Landmark& landmark, const Keyframe& reference, Map* map) const;
  /// Where the keyframe's image shows what was measured. Nothing outside the lens's range.
  std::optional<DetectedPixel> InRow(const PixelMeasurement& measured, const Landmark& landmark,
                                     const Keyframe& keyframe) const;
  std::optional<PixelMeasurement> MeasureBy(const Keyframe& reference,
                                            const PixelMeasurement& reference_measured,
                                            const Eigen::Vector3d& position_world,
                                            const Eigen::Vector3d& normal_world,
                                            const Keyframe& keyframe,
                                            const DetectedPixel& start) const;

  Camera camera_;
  PatchOptions options_;
  ReferenceViewOptions reference_;
  SurfaceNormalOptions surface_;
};

}  // namespace deepuav
