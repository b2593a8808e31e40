#include "deepuav/system/shutter/readout_run.h"

namespace deepuav {

std::optional<FoundReadout> ReadoutRun::Search(const ReadoutPath& path_per_s, MapId map,
                                               const std::function<bool()>& stop) const {
  return mapper->SearchReadout(
      map, MotionsOfKeyframes(path_per_s, atlas->At(map), first_new_keyframe), stop);
}

void ReadoutRun::Take(const ReadoutPath& path, MapId map, std::vector<FrameRecord>* records) const {
  ChangeMotions(path, *atlas, map, *camera, records);
  mapper->ChangeMotionsIn(map, MotionsOfKeyframes(path, atlas->At(map), first_new_keyframe));
}

void ReadoutRun::Adjust(MapId map, const std::function<bool()>& stop) const {
  mapper->AdjustGlobally(map, &camera->pinhole, false, stop);
}

}  // namespace deepuav
