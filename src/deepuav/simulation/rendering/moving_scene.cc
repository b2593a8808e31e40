#include "deepuav/simulation/rendering/moving_scene.h"

namespace deepuav {

void MovingScene::SetInterval(double start_s, double end_s) {
  start_s_ = start_s;
  length_s_ = end_s - start_s;
  if (world_.outdoors() == nullptr) return;
  const Traffic& traffic = world_.outdoors()->traffic;
  if (traffic.movers().empty()) return;
  from_.clear();
  to_.clear();
  scene_.reset(rtcNewScene(world_.device()));
  for (const Traffic::Mover& mover : traffic.movers()) {
    from_.push_back(traffic.PlacementAt(mover, start_s));
    to_.push_back(traffic.Jumps(mover, start_s, end_s) ? from_.back()
                                                       : traffic.PlacementAt(mover, end_s));
    AddInstance(world_.device(), scene_.get(), world_.mover_scene(mover.prototype), from_.back(),
                length_s_ > 0 ? &to_.back() : nullptr);
  }
  rtcCommitScene(scene_.get());
  CheckEmbree(world_.device(), "the scene of moving things");
}

}  // namespace deepuav
