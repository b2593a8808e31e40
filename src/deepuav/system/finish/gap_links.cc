#include "deepuav/system/finish/gap_links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/estimation/poses/bearing_rotation.h"

namespace deepuav {
namespace {

constexpr int kRotationTries = 200;
constexpr size_t kDenseStep = 8;  // frames, up to which each is linked
constexpr int kMaxPairs = 100;    // of a link, or more if it needs them: each costs time
constexpr int kNearStep = 2;      // frames, between which a link tells how the camera moved
constexpr double kToleranceSigmas = 3;
constexpr double kMaxToleranceRatio = 0.1;  // of the image's width: room beyond says nothing

/// Turns frame by frame, with what is missing to the last one's known orientation spread over all.
void TurnAlong(const std::vector<Eigen::Quaterniond>& next_from_frame, size_t first, size_t last,
               std::vector<PathFrame>* frames) {
  std::vector<Eigen::Quaterniond> cam_from_world = {(*frames)[first].cam_from_world.rotation()};
  for (size_t i = first; i < last; ++i)
    cam_from_world.push_back(next_from_frame[i] * cam_from_world.back());
  const Eigen::Quaterniond missing =
      (*frames)[last].cam_from_world.rotation() * cam_from_world.back().conjugate();
  const double whole_s = (*frames)[last].time_s - (*frames)[first].time_s;
  for (size_t i = first + 1; i < last; ++i) {
    PathFrame& frame = (*frames)[i];
    const double share = (frame.time_s - (*frames)[first].time_s) / whole_s;
    const Eigen::Quaterniond rotation =
        Eigen::Quaterniond::Identity().slerp(share, missing) * cam_from_world[i - first];
    const Eigen::Vector3d centre = frame.cam_from_world.InverseTranslation();
    frame.cam_from_world = SE3(rotation, -(rotation * centre));
  }
}

}  // namespace

double PositionSigma(const GapPath::Pose& pose) {
  return std::sqrt(pose.covariance.topLeftCorner<3, 3>().trace());
}

GapLinker::GapLinker(const Camera& camera, Matcher* matcher, const GapOptions& options)
    : camera_(camera), matcher_(matcher), options_(options) {}

double GapLinker::TolerancePx(const InverseDepth& scene, const GapPath& path, size_t a,
                              size_t b) const {
  const GapPath::Pose &from = path.poses[a], &to = path.poses[b];
  const double apart =
      (from.cam_from_world.InverseTranslation() - to.cam_from_world.InverseTranslation()).norm() +
      kToleranceSigmas * std::hypot(PositionSigma(from), PositionSigma(to));
  const double parallax_px =
      camera_.pinhole.fx * apart * (scene.mean + kToleranceSigmas * scene.sigma);
  const double noise_px = kToleranceSigmas * M_SQRT2;
  return noise_px + std::min(parallax_px, kMaxToleranceRatio * camera_.width);
}

void GapLinker::Link(const GapPath& start, const std::vector<FrameId>& ids,
                     const FeaturesOfFrames& features, const std::function<bool()>& stop,
                     GapPathProblem* problem) const {
  std::vector<PathFrame>& frames = problem->frames;
  std::vector<Eigen::Quaterniond> next_from_frame;
  for (size_t i = 0; i < frames.size(); ++i)
    frames[i].cam_from_world = start.poses[i].cam_from_world;
  for (size_t a = 0; a + 1 < frames.size(); ++a) {
    if (stop && stop()) return;
    std::optional<Eigen::Quaterniond> turn;
    // The farther two are from one another, the fewer lead from one end to the other.
    for (size_t far = 1; a + far < frames.size(); far *= 2) {
      if (far > kDenseStep && a % (far / kDenseStep) != 0) break;
      const size_t b = a + far;
      if (frames[a].is_known && frames[b].is_known) continue;
      const auto found =
          LinkTwo(a, b, TolerancePx(problem->scene, start, a, b), ids[a], features, problem);
      if (far == 1) turn = found;
      if (far >= kDenseStep && !found) break;
    }
    next_from_frame.push_back(turn.value_or(frames[a + 1].cam_from_world.rotation() *
                                            frames[a].cam_from_world.rotation().conjugate()));
  }
  size_t known = 0;
  for (size_t i = 1; i < frames.size(); ++i) {
    if (!frames[i].is_known) continue;
    TurnAlong(next_from_frame, known, i, &frames);
    known = i;
  }
}

std::optional<Eigen::Quaterniond> GapLinker::LinkTwo(size_t a, size_t b, double tolerance_px,
                                                     FrameId id, const FeaturesOfFrames& features,
                                                     GapPathProblem* problem) const {
  const auto &of_a = features[a], &of_b = features[b];
  if (!of_a || !of_b) return std::nullopt;
  std::vector<PixelPair> pixels;
  std::vector<double> sigmas_px;
  for (const Match& match : matcher_->MatchFeatures(*of_a, *of_b)) {
    const Keypoint& in_a = of_a->keypoints[static_cast<size_t>(match.a)];
    const Keypoint& in_b = of_b->keypoints[static_cast<size_t>(match.b)];
    pixels.push_back({in_a.px.cast<double>(), in_b.px.cast<double>()});
    sigmas_px.push_back(std::hypot(in_a.sigma_px, in_b.sigma_px));
  }
  const auto turn = EstimateBearingRotation(camera_.pinhole, pixels, tolerance_px, kRotationTries,
                                            static_cast<uint64_t>(id.value));
  if (!turn || turn->inlier_count < options_.min_pairs ||
      turn->inlier_count < options_.min_pair_ratio * static_cast<double>(pixels.size()))
    return std::nullopt;
  FrameLink link{static_cast<int>(a), static_cast<int>(b), {}};
  // Every so many of them, as they lie all over the image.
  const int most = std::max(kMaxPairs, 2 * options_.min_pairs);
  const double keep = std::min(1.0, static_cast<double>(most) / turn->inlier_count);
  double due = 1;
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (!turn->inlier[i]) continue;
    if (due >= 1) link.pairs.push_back({pixels[i].a_px, pixels[i].b_px, sigmas_px[i]});
    due += keep - std::floor(due);
  }
  problem->links.push_back(std::move(link));
  return turn->b_from_a;
}

bool GapLinker::Holds(const GapPathProblem& problem, const GapPath& path, size_t link) const {
  const int agreeing = path.link_inlier_count[link];
  const auto all = static_cast<double>(problem.links[link].pairs.size());
  return agreeing >= options_.min_pairs && agreeing >= options_.min_pair_ratio * all;
}

std::vector<uint8_t> GapLinker::StepsSeen(const GapPathProblem& problem,
                                          const GapPath& path) const {
  std::vector<uint8_t> is_seen(problem.frames.size() - 1, 0);
  for (size_t k = 0; k < problem.links.size(); ++k) {
    const FrameLink& link = problem.links[k];
    // One that leads farther does not tell what lies on the way.
    if (link.b - link.a > kNearStep || !Holds(problem, path, k)) continue;
    std::fill(is_seen.begin() + link.a, is_seen.begin() + link.b, 1);
  }
  return is_seen;
}

void GapLinker::DropDoubtful(const GapPath& path, GapPathProblem* problem) const {
  std::vector<FrameLink> holding;
  for (size_t k = 0; k < problem->links.size(); ++k) {
    if (Holds(*problem, path, k)) holding.push_back(std::move(problem->links[k]));
  }
  problem->links = std::move(holding);
}

}  // namespace deepuav
