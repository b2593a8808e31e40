#include "deepuav/system/shutter/image_turns.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "deepuav/base/median.h"
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

Turning TurningOf(const ReadoutMotion& motion) {
  Turning turning;
  turning << motion.turn_rad, motion.bend_rad;
  return turning;
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
  double cost_known = 0, cost = 0;  ///< Of what it sees, without that change and with it.
};

/// A turn fits some of the noise, too: what would have been saved by nothing is taken back.
double ForFreedom(int observations, TurnModel model) {
  const int pose = 6, turn = model == TurnModel::kTurnAndBend ? 6 : 3;
  return (2.0 * observations - pose) / (2.0 * observations - pose - turn);
}

/// Asks images of a map.
class ImageQuestion {
 public:
  ImageQuestion(const Map& map, const Camera& camera, TurnModel model,
                const TurningPoseOptions& options)
      : map_(map), camera_(camera), model_(model), options_(options) {}

  /// Nothing where it sees too little.
  std::optional<Told> Ask(const FrameRecord& record, const SE3& pose) const {
    const auto rows = RowsSeen(map_, record, pose, camera_);
    const auto known = OptimiseTurningPose(camera_.pinhole, rows, pose, TurnModel::kNone, options_);
    const auto found = OptimiseTurningPose(camera_.pinhole, rows, pose, model_, options_);
    if (!known || !found) return std::nullopt;
    Told told;
    told.known = TurningOf(record.seen_motion);
    told.change << found->turn_rad, found->bend_rad;
    told.sigma_rad = found->turn_sigma_rad;
    told.cost_known = known->cost;
    told.cost = found->cost * ForFreedom(found->used, model_);
    return told;
  }

 private:
  const Map& map_;
  const Camera& camera_;
  const TurnModel model_;
  const TurningPoseOptions& options_;
};

double SavedShare(const std::map<Timestamp, Told>& told) {
  double known = 0, left = 0;
  for (const auto& [time, of] : told) {
    known += of.cost_known;
    left += of.cost;
  }
  return known > 0 ? 1 - left / known : 0;
}

/// Images that see little, or all of it in a few rows, hardly tell how they turned: that is not to
/// hide what the others tell.
double MostSureSigma(const std::map<Timestamp, Told>& told, double max_ratio) {
  std::vector<double> sigmas_rad;
  for (const auto& [time, of] : told) sigmas_rad.push_back(of.sigma_rad);
  return max_ratio * Median(std::move(sigmas_rad));
}

/// Without what is slow in those of images that are sure or, where there are none near, in all.
TurningAt QuickPart(const TurningAt& all, const std::map<Timestamp, Told>& told,
                    double max_sigma_rad, double slow_s) {
  TurningAt sure, quick;
  for (const auto& [time, turning] : all) {
    if (told.at(time).sigma_rad <= max_sigma_rad) sure[time] = turning;
  }
  for (const auto& [time, turning] : all) {
    const auto slow = SlowPart(sure, time, slow_s);
    quick[time] = turning - (slow ? *slow : *SlowPart(all, time, slow_s));
  }
  return quick;
}

/// Mean square of the turns about an axis, of images that are sure.
double MeanSquare(const TurningAt& turns, const std::map<Timestamp, Told>& told,
                  double max_sigma_rad) {
  double sum = 0, count = 0;
  for (const auto& [time, turning] : turns) {
    if (told.at(time).sigma_rad > max_sigma_rad) continue;
    sum += turning.head<3>().squaredNorm() / 3;
    ++count;
  }
  return sum / count;
}

double MeanSquaredNoise(const std::map<Timestamp, Told>& told, double max_sigma_rad) {
  double sum = 0, count = 0;
  for (const auto& [time, of] : told) {
    if (of.sigma_rad > max_sigma_rad) continue;
    sum += of.sigma_rad * of.sigma_rad;
    ++count;
  }
  return sum / count;
}

/// What is quick in them, each as far as it is to be told from noise. Fills in how much that
/// changes what is known.
TurningAt QuickTurns(const std::map<Timestamp, Told>& told, const ImageTurnOptions& options,
                     ImageTurns* turns) {
  TurningAt change, all;
  for (const auto& [time, of] : told) {
    change[time] = of.change;
    all[time] = of.known + of.change;
  }
  const double most_rad = MostSureSigma(told, options.max_sigma_ratio);
  TurningAt quick = QuickPart(all, told, most_rad, options.slow_s);
  const double noise = MeanSquaredNoise(told, most_rad);
  turns->noise_rad = std::sqrt(noise);
  turns->changed_rad =
      std::sqrt(MeanSquare(QuickPart(change, told, most_rad, options.slow_s), told, most_rad));
  const double signal = std::max(0.0, MeanSquare(quick, told, most_rad) - noise);
  for (auto& [time, turning] : quick) {
    const double sigma_rad = told.at(time).sigma_rad;
    if (sigma_rad > 0) turning *= signal / (signal + sigma_rad * sigma_rad);
  }
  return quick;
}

}  // namespace

void ImageTurnOptions::Check() const { CheckOptions("image_turns", *this); }

std::vector<FrameRecord> FirstAsked(const std::vector<FrameRecord>& records,
                                    const ImageTurnOptions& options) {
  const size_t stretch = static_cast<size_t>(options.first_stretch);
  const size_t stretches = std::max<size_t>(1, static_cast<size_t>(options.first_images) / stretch);
  if (records.size() <= stretches * stretch) return records;
  std::vector<FrameRecord> first;
  for (size_t i = 0; i < stretches; ++i) {
    const size_t middle = (2 * i + 1) * records.size() / (2 * stretches);
    const auto begin = records.begin() + static_cast<std::ptrdiff_t>(middle - stretch / 2);
    first.insert(first.end(), begin, begin + static_cast<std::ptrdiff_t>(stretch));
  }
  return first;
}

std::map<Timestamp, ReadoutMotion> SlowTurns(const Trajectory& path, double readout_s,
                                             const ImageTurnOptions& options) {
  const TurningAt steps = TurnsOfPath(path, readout_s, options.max_step_s);
  std::map<Timestamp, ReadoutMotion> motions;
  for (const TimedPose& at : path) {
    if (const auto slow = SlowPart(steps, at.time, options.slow_s))
      motions[at.time] = MotionOf(*slow);
  }
  return motions;
}

ImageTurns MeasureImageTurns(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                             const PoseOfFrame& pose_of_frame, const Camera& camera,
                             TurnModel model, const ImageTurnOptions& options,
                             const std::function<bool()>& stop) {
  ImageTurns turns;
  turns.slow_motions =
      SlowTurns(PathIn(atlas, map, records, pose_of_frame), camera.readout_s, options);
  const ImageQuestion question(atlas.At(map), camera, model, options.pose);
  std::map<Timestamp, Told> told;
  for (const FrameRecord& record : records) {
    if (stop && stop()) return {};
    if (!record.located() || atlas.Current(record.map) != atlas.Current(map)) continue;
    if (!turns.slow_motions.contains(record.time)) continue;
    if (const auto answer = question.Ask(record, pose_of_frame(record)))
      told[record.time] = *answer;
  }
  if (told.empty()) return {};
  turns.saved_share = SavedShare(told);
  for (const auto& [time, quick] : QuickTurns(told, options, &turns)) {
    const auto slow = turns.slow_motions.extract(time);
    turns.motions[time] = MotionOf(TurningOf(slow.mapped()) + quick);
  }
  return turns;
}

bool AreBelieved(const ImageTurns& turns, double min_cost_share, const ImageTurnOptions& options) {
  return !turns.motions.empty() && turns.saved_share >= min_cost_share &&
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
