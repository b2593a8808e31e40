#pragma once

#include "deepuav/map/atlas.h"
#include "deepuav/map/map_correction.h"
#include "deepuav/mapping/landmarks/patch_observation.h"

namespace deepuav {

/// Moves keyframes, and each landmark with the keyframe of its representative.
void MoveKeyframes(const std::vector<KeyframeMove>& moves, Map* map);

/// Gives the keyframe the landmarks that it sees at the place; where it has its own, that becomes
/// one with the place's.
void FuseTie(const LoopTie& tie, const PatchObserver& observer, Map* map);

/// Makes the two maps of a correction one: the younger moves into the world of the older, whatever
/// map was found in which.
void MergeMaps(const MapCorrection& correction, Atlas* atlas);

}  // namespace deepuav
