#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "deepuav/estimation/paths/gap_path.h"
#include "deepuav/features/keypoint_grid.h"
#include "deepuav/localisation/frame_locator.h"
#include "deepuav/map/atlas.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/system/finish/gap_links.h"
#include "deepuav/system/finish/gap_options.h"
#include "deepuav/system/finish/path_gaps.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

/// What a gap is bridged with, beside the records.
struct GapSight {
  Camera camera;
  LocatorOptions locator;
  LocalMapOptions local_map;
  Matcher* matcher = nullptr;
};

/// At the end of a run, gives frames without a pose between two that have one in the same map the
/// most probable one, from how the camera moves, how its images turn, and the few landmarks in
/// them. Frames beside them that see few landmarks are placed anew with them. The map stays as it
/// is.
class GapBridge {
 public:
  /// `atlas` and the matcher must outlive it. `features`: of each record, where they were kept.
  GapBridge(const GapSight& sight, const GapOptions& options, const Atlas& atlas,
            std::vector<std::shared_ptr<const Features>> features);

  /// Returns how many frames got a pose. Asked to `stop`, it leaves the stretch at hand and those
  /// after it.
  int Bridge(std::vector<FrameRecord>* records, const std::function<bool()>& stop = nullptr) const;

 private:
  struct Stretch;

  int BridgeOne(const PathStretch& gap, const std::function<bool()>& stop,
                std::vector<FrameRecord>* records) const;
  Stretch Begin(const PathStretch& gap, const std::vector<FrameRecord>& records) const;
  /// What is known of a record's pose before images are asked; notes the keyframes near it.
  PathFrame Place(const std::vector<FrameRecord>& records, size_t i, Stretch* stretch) const;
  MotionNoise MotionAbout(const Stretch& stretch, const std::vector<FrameRecord>& records) const;
  InverseDepth SceneOf(const Stretch& stretch, const std::vector<FrameRecord>& records) const;
  /// Landmarks in windows around where the path expects them.
  void LookForLandmarks(const GapPath& path, double radius_px, Stretch* stretch) const;
  void AddLandmarksOf(const LocalMap& local_map, const Features& features, const KeypointGrid& grid,
                      double radius_px, std::vector<uint8_t>* taken, PathFrame* frame) const;
  bool Contradicts(const Stretch& stretch, const GapPath& path) const;
  /// One per frame: whether images or a known pose tie it to both sides for long enough.
  std::vector<uint8_t> WhatImagesTell(const Stretch& stretch, const GapPath& path) const;
  int Take(const Stretch& stretch, const GapPath& path, std::vector<FrameRecord>* records) const;

  const GapSight sight_;
  const GapOptions options_;
  const GapLinker linker_;
  const Atlas& atlas_;
  const std::vector<std::shared_ptr<const Features>> features_;
};

}  // namespace deepuav
