#include "deepuav/system/shutter/image_turns.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "deepuav/base/option_check.h"
#include "deepuav/map/frame_motion.h"

namespace deepuav {
namespace {

/// A turn at some moment, with its bend.
using Turning = Eigen::Matrix<double, 6, 1>;
using TurningAt = std::map<Timestamp, Turning>;

std::vector<RowObservation> RowsSeen(const Map& map, const FrameRecord& record,
                                     const SE3& cam_from_world, const Camera& camera) {
  std::vector<RowObservation> rows;
  for (const PoseObservation& seen : ObservationsOf(map, record, cam_from_world)) {
    const auto raw = DistortInRow(camera, seen.px, record.seen_motion);
    if (raw) rows.push_back({seen, RowMoment(raw->y(), camera.height)});
  }
  return rows;
}

/// Mean about a moment, weighed by a window of Hann's; nothing where there is none so near.
std::optional<Turning> SlowPart(const TurningAt& turns, Timestamp about, double reach_s) {
  const auto reach_ns = static_cast<int64_t>(1e9 * reach_s);
  Turning sum = Turning::Zero();
  double weights = 0;
  const auto first = turns.lower_bound({about.nanoseconds - reach_ns});
  for (auto at = first; at != turns.end(); ++at) {
    const double share = SecondsBetween(about, at->first) / reach_s;
    if (share >= 1) break;
    const double weight = std::pow(std::cos(share * std::numbers::pi / 2), 2);
    sum += weight * at->second;
    weights += weight;
  }
  if (!(weights > 0)) return std::nullopt;
  return sum / weights;
}

/// What passes in a readout of how the camera turns from image to image, between the two.
TurningAt TurnsOfPath(const Trajectory& path, double readout_s, double max_step_s) {
  TurningAt turns;
  for (size_t i = 1; i < path.size(); ++i) {
    const double step_s = SecondsBetween(path[i - 1].time, path[i].time);
    if (!(step_s > 0 && step_s <= max_step_s)) continue;
    const SE3 before_from_now = path[i - 1].world_from_cam.Inverse() * path[i].world_from_cam;
    const int64_t half_ns = (path[i].time.nanoseconds - path[i - 1].time.nanoseconds) / 2;
    Turning turn = Turning::Zero();
    turn.head<3>() = readout_s / step_s * before_from_now.Log().tail<3>();
    turns[{path[i - 1].time.nanoseconds + half_ns}] = turn;
  }
  return turns;
}

ReadoutMotion MotionOf(const Turning& turning) {
  ReadoutMotion motion;
  motion.turn_rad = turning.head<3>();
  motion.bend_rad = turning.tail<3>();
  return motion;
}

/// What an image tells of its turn.
struct Told {
  Turning known;   ///< So far.
  Turning change;  ///< That it wants.
  double sigma_rad = 0;
};

struct AllTold {
  std::map<Timestamp, Told> images;
  double cost_known = 0, cost = 0;
};

/// A turn fits some of the noise, too: what would have been saved by nothing is taken back.
double ForFreedom(int observations, TurnModel model) {
  const int pose = 6, turn = model == TurnModel::kTurnAndBend ? 6 : 3;
  return (2.0 * observations - pose) / (2.0 * observations - pose - turn);
}

/// Of images about which the path's own slow turn is known.
AllTold AskImages(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                  const PoseOfFrame& pose_of_frame, const Camera& camera, TurnModel model,
                  const ImageTurnOptions& options, const TurningAt& steps,
                  const std::function<bool()>& stop) {
  const Map& in = atlas.At(map);
  AllTold told;
  for (const FrameRecord& record : records) {
    if (stop && stop()) return {};
    if (!record.located() || atlas.Current(record.map) != in.id()) continue;
    if (!SlowPart(steps, record.time, options.slow_s)) continue;
    const SE3 pose = pose_of_frame(record);
    const auto rows = RowsSeen(in, record, pose, camera);
    const auto known =
        OptimiseTurningPose(camera.pinhole, rows, pose, TurnModel::kNone, options.pose);
    const auto found = OptimiseTurningPose(camera.pinhole, rows, pose, model, options.pose);
    if (!known || !found) continue;
    told.cost_known += known->cost;
    told.cost += found->cost * ForFreedom(found->used, model);
    Told& of = told.images[record.time];
    of.known << record.seen_motion.turn_rad, record.seen_motion.bend_rad;
    of.change << found->turn_rad, found->bend_rad;
    of.sigma_rad = found->turn_sigma_rad;
  }
  return told;
}

/// Without what is slow in them. Fills in how much that changes what is known.
TurningAt QuickPart(const std::map<Timestamp, Told>& told, double slow_s, ImageTurns* turns) {
  TurningAt change, all, quick;
  for (const auto& [time, of] : told) {
    change[time] = of.change;
    all[time] = of.known + of.change;
  }
  double changed = 0, noise = 0;
  for (const auto& [time, of] : told) {
    quick[time] = all[time] - *SlowPart(all, time, slow_s);
    const Turning quick_change = of.change - *SlowPart(change, time, slow_s);
    changed += quick_change.head<3>().squaredNorm() / 3;
    noise += of.sigma_rad * of.sigma_rad;
  }
  const double count = std::max<double>(1, static_cast<double>(told.size()));
  turns->changed_rad = std::sqrt(changed / count);
  turns->noise_rad = std::sqrt(noise / count);
  return quick;
}

}  // namespace

void ImageTurnOptions::Check() const { CheckOptions("image_turns", *this); }

ImageTurns MeasureImageTurns(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                             const PoseOfFrame& pose_of_frame, const Camera& camera,
                             TurnModel model, const ImageTurnOptions& options,
                             const std::function<bool()>& stop) {
  const Trajectory path = PathIn(atlas, map, records, pose_of_frame);
  const TurningAt steps = TurnsOfPath(path, camera.readout_s, options.max_step_s);
  const AllTold told =
      AskImages(atlas, map, records, pose_of_frame, camera, model, options, steps, stop);
  ImageTurns turns;
  if (told.images.empty()) return turns;
  turns.saved_share = told.cost_known > 0 ? 1 - told.cost / told.cost_known : 0;
  const TurningAt quick = QuickPart(told.images, options.slow_s, &turns);
  for (const TimedPose& at : path) {
    const auto slow = SlowPart(steps, at.time, options.slow_s);
    if (!slow) continue;
    const auto own = quick.find(at.time);
    if (own != quick.end()) {
      turns.motions[at.time] = MotionOf(*slow + own->second);
    } else {
      turns.slow_motions[at.time] = MotionOf(*slow);
    }
  }
  return turns;
}

bool AreBelieved(const ImageTurns& turns, const ImageTurnOptions& options) {
  return !turns.motions.empty() && turns.saved_share >= options.min_cost_share &&
         turns.changed_rad >= options.min_spread * turns.noise_rad;
}

void TakeTurns(const ImageTurns& turns, ReadoutPath* path) {
  for (const auto* told : {&turns.slow_motions, &turns.motions}) {
    for (const auto& [time, turn] : *told) {
      const auto motion = path->motions.find(time);
      if (motion != path->motions.end()) motion->second = WithTurnOf(turn, motion->second);
    }
  }
}

void MarkMeasured(const ImageTurns& turns, const Atlas& atlas, MapId map,
                  std::vector<FrameRecord>* records) {
  for (FrameRecord& record : *records) {
    if (!record.located() || atlas.Current(record.map) != atlas.Current(map)) continue;
    if (turns.motions.contains(record.time)) record.turn_is_measured = true;
  }
}

}  // namespace deepuav
