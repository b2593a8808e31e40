#include "deepuav/survey/pairs/pair_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>
#include <set>

#include "deepuav/estimation/two_views/usac.h"

namespace deepuav {
namespace {

/// Counts in the cells of an image.
class CellCounts {
 public:
  static constexpr size_t kColumns = 8, kRows = 6;

  explicit CellCounts(const cv::Size& image_size) : size_(image_size) {}

  void Add(const cv::Point2d& px) {
    const double column = px.x * kColumns / size_.width, row = px.y * kRows / size_.height;
    const auto clamped = [](double at, size_t count) {
      return static_cast<size_t>(std::clamp(at, 0.0, static_cast<double>(count - 1)));
    };
    ++counts_[clamped(row, kRows) * kColumns + clamped(column, kColumns)];
  }
  int At(size_t cell) const { return counts_[cell]; }
  static constexpr size_t size() { return kColumns * kRows; }

 private:
  const cv::Size size_;
  std::array<int, kColumns* kRows> counts_ = {};
};

cv::Point2d PointOf(const Features& features, int keypoint) {
  const Eigen::Vector2f& px = features.keypoints[static_cast<size_t>(keypoint)].image_px;
  return {px.x(), px.y()};
}

/// As seen by a.
double CoverageIn(const Features& a, const std::vector<cv::Point2d>& matched_a,
                  const cv::Matx33d& b_from_a, const cv::Size& size,
                  const PairEvidenceOptions& options) {
  CellCounts common(size), matched(size);
  for (const Keypoint& keypoint : a.keypoints) {
    const cv::Point2d px(keypoint.image_px.x(), keypoint.image_px.y());
    const cv::Vec3d in_b = b_from_a * cv::Vec3d(px.x, px.y, 1);
    const double x = in_b[0] / in_b[2], y = in_b[1] / in_b[2];
    if (x >= 0 && y >= 0 && x < size.width && y < size.height) common.Add(px);
  }
  for (const cv::Point2d& px : matched_a) matched.Add(px);
  int telling = 0, covered = 0;
  for (size_t cell = 0; cell < CellCounts::size(); ++cell) {
    if (common.At(cell) < options.telling_keypoints) continue;
    ++telling;
    covered += matched.At(cell) > 0;
  }
  return telling >= options.telling_cells ? static_cast<double>(covered) / telling : 0;
}

const SE3& PoseOf(const SurveyState& state, int view) {
  return *state.cam_from_world[static_cast<size_t>(view)];
}

/// The point of the map that a key point shows, if it has one and agrees with it. Key points that a
/// photograph got after the map was made (seen reduced) have none.
std::optional<Eigen::Vector3d> PointSeen(const BuiltSurvey& map, int view, int keypoint) {
  const std::vector<int>& tracks = map.tracks.of_keypoint[static_cast<size_t>(view)];
  if (keypoint >= std::ssize(tracks)) return std::nullopt;
  const int track = tracks[static_cast<size_t>(keypoint)];
  if (track < 0) return std::nullopt;
  const auto at = static_cast<size_t>(track);
  const std::vector<Track::Sight>& sights = map.tracks.tracks[at].sights;
  const auto sight = std::ranges::find(sights, view, &Track::Sight::view);
  if (!map.state.agrees[at][static_cast<size_t>(sight - sights.begin())]) return std::nullopt;
  return map.state.points[at];
}

bool IsSeenAt(const SurveyState& state, const Eigen::Vector3d& point, int view,
              const Eigen::Vector2d& px, double limit_px) {
  return SquaredErrorPx(state.lens.camera, PoseOf(state, view) * point, px) <= limit_px * limit_px;
}

}  // namespace

double MatchCoverage(const Features& a, const Features& b, const std::vector<Match>& matches,
                     const cv::Size& image_size, const PairEvidenceOptions& options) {
  constexpr double kConfidence = 0.999;
  constexpr int kIterations = 1000, kLeast = 4;
  if (std::ssize(matches) < kLeast) return 0;
  std::vector<cv::Point2d> in_a, in_b;
  for (const Match& match : matches) {
    in_a.push_back(PointOf(a, match.a));
    in_b.push_back(PointOf(b, match.b));
  }
  cv::Mat inlier;
  const cv::Mat found = cv::findHomography(
      in_a, in_b, inlier,
      MakeUsacParams(options.rough_plane_px, kConfidence, kIterations, matches.size()));
  if (found.empty()) return 0;
  const cv::Matx33d b_from_a = found;
  return std::min(CoverageIn(a, in_a, b_from_a, image_size, options),
                  CoverageIn(b, in_b, b_from_a.inv(), image_size, options));
}

PairJudge::PairJudge(const std::vector<SurveyView>& views, const ViewPixels& px,
                     const cv::Size& image_size, const SurveyOptions& options)
    : views_(views), px_(px), image_size_(image_size), options_(options) {}

double PairJudge::AgreeingShare(const MatchedPair& pair, const BuiltSurvey& map) const {
  const double limit = options_.evidence.map_error_factor * options_.pair_error_px;
  int seen = 0, in_place = 0, on_line = 0;
  for (const Match& match : pair.matches) {
    const auto of_a = PointSeen(map, pair.a, match.a), of_b = PointSeen(map, pair.b, match.b);
    on_line += FitsEpipolarLine(pair, match, map.state);
    if (!of_a && !of_b) continue;
    ++seen;
    in_place += (of_a && IsSeenAt(map.state, *of_a, pair.b, PixelOf(pair.b, match.b), limit)) ||
                (of_b && IsSeenAt(map.state, *of_b, pair.a, PixelOf(pair.a, match.a), limit));
  }
  if (seen >= options_.evidence.telling_points) return static_cast<double>(in_place) / seen;
  return pair.matches.empty() ? 0 : static_cast<double>(on_line) / std::ssize(pair.matches);
}

bool PairJudge::FitsEpipolarLine(const MatchedPair& pair, const Match& match,
                                 const SurveyState& state) const {
  const auto ray_a = state.lens.Ray(PixelOf(pair.a, match.a));
  const auto ray_b = state.lens.Ray(PixelOf(pair.b, match.b));
  if (!ray_a || !ray_b) return false;
  const double limit = options_.pair_error_px / state.lens.camera.pinhole.fx;
  const SE3 b_from_a = PoseOf(state, pair.b) * PoseOf(state, pair.a).Inverse();
  const Eigen::Vector3d turned = b_from_a.rotation() * *ray_a;
  const Eigen::Vector3d line = b_from_a.translation().cross(turned);
  // Without a baseline there is no line.
  if (std::abs(line.dot(*ray_b)) < limit * line.head<2>().norm()) return true;
  return turned.z() > 0 && (turned.hnormalized() - ray_b->hnormalized()).norm() <= limit;
}

bool PairJudge::IsExplained(const MatchedPair& pair, const BuiltSurvey& map) const {
  return map.state.Has(pair.a) && map.state.Has(pair.b) &&
         AgreeingShare(pair, map) >= options_.evidence.explained_share;
}

double PairJudge::CoverageOf(MatchedPair* pair) const {
  if (!pair->coverage) {
    pair->coverage = MatchCoverage(*views_[static_cast<size_t>(pair->a)].frame.features,
                                   *views_[static_cast<size_t>(pair->b)].frame.features,
                                   pair->matches, image_size_, options_.evidence);
  }
  return *pair->coverage;
}

std::vector<size_t> PairJudge::Contradicting(std::vector<MatchedPair>* pairs,
                                             const BuiltSurvey& map) const {
  std::vector<size_t> contradicting;
  for (size_t i = 0; i < pairs->size(); ++i) {
    MatchedPair& pair = (*pairs)[i];
    if (!map.state.Has(pair.a) || !map.state.Has(pair.b)) continue;
    if (std::ssize(pair.matches) < options_.contradicting_matches) continue;
    if (AgreeingShare(pair, map) >= options_.evidence.contradicting_share) continue;
    if (CoverageOf(&pair) >= options_.contradicting_coverage) contradicting.push_back(i);
  }
  return contradicting;
}

bool PairJudge::SetSuspectsAside(const BuiltSurvey& map, bool everywhere,
                                 std::vector<MatchedPair>* pairs,
                                 std::vector<MatchedPair>* suspects) const {
  if (Doubtful(pairs, map).empty()) return false;
  std::set<int> misplaced;
  for (const size_t i : Contradicting(pairs, map)) misplaced.insert({(*pairs)[i].a, (*pairs)[i].b});
  const auto is_suspect = [&](MatchedPair& pair) {
    if (!map.state.Has(pair.a) || !map.state.Has(pair.b)) return false;
    const bool in_doubt = everywhere || misplaced.contains(pair.a) || misplaced.contains(pair.b) ||
                          !IsExplained(pair, map);
    return in_doubt && CoverageOf(&pair) < options_.suspect_coverage;
  };
  const size_t before = suspects->size();
  std::vector<MatchedPair> trusted;
  for (MatchedPair& pair : *pairs)
    (is_suspect(pair) ? *suspects : trusted).push_back(std::move(pair));
  *pairs = std::move(trusted);
  return suspects->size() > before;
}

double PairJudge::WeightOf(MatchedPair* pair) const {
  return static_cast<double>(pair->matches.size()) *
         std::pow(CoverageOf(pair), options_.evidence.coverage_power);
}

std::vector<Tie> PairJudge::TiesIn(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const {
  std::vector<Tie> ties;
  for (MatchedPair& pair : *pairs) {
    if (IsExplained(pair, map)) ties.push_back({pair.a, pair.b, WeightOf(&pair)});
  }
  for (const size_t i : Contradicting(pairs, map)) {
    MatchedPair& pair = (*pairs)[i];
    ties.push_back({pair.a, pair.b, -WeightOf(&pair)});
  }
  return ties;
}

double PairJudge::Agreement(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const {
  double agreement = 0;
  for (const Tie& tie : TiesIn(pairs, map)) agreement += tie.weight;
  return agreement;
}

std::vector<int> PairJudge::Doubtful(std::vector<MatchedPair>* pairs,
                                     const BuiltSurvey& map) const {
  return Contradicted(options_.evidence.doubtful_ratio, pairs, map);
}

std::vector<int> PairJudge::Misplaced(std::vector<MatchedPair>* pairs,
                                      const BuiltSurvey& map) const {
  return Contradicted(1, pairs, map);
}

std::vector<int> PairJudge::MisplacedTogether(std::vector<MatchedPair>* pairs,
                                              const BuiltSurvey& map) const {
  return TornOff(TiesIn(pairs, map), static_cast<int>(map.state.cam_from_world.size()));
}

void PairJudge::SetHoldingAside(const std::vector<int>& views, const BuiltSurvey& map,
                                std::vector<MatchedPair>* pairs,
                                std::vector<MatchedPair>* holding) const {
  const std::set<int> among(views.begin(), views.end());
  const auto holds = [&](const MatchedPair& pair) {
    return among.contains(pair.a) != among.contains(pair.b) && IsExplained(pair, map);
  };
  std::vector<MatchedPair> others;
  for (MatchedPair& pair : *pairs) (holds(pair) ? *holding : others).push_back(std::move(pair));
  *pairs = std::move(others);
}

/// Against which more is said than `ratio` of what is said for them.
std::vector<int> PairJudge::Contradicted(double ratio, std::vector<MatchedPair>* pairs,
                                         const BuiltSurvey& map) const {
  struct Said {
    double for_it = 0, against_it = 0;
  };
  std::vector<Said> of_view(map.state.cam_from_world.size());
  for (const Tie& tie : TiesIn(pairs, map)) {
    for (const int view : {tie.a, tie.b}) {
      Said& said = of_view[static_cast<size_t>(view)];
      (tie.weight < 0 ? said.against_it : said.for_it) += std::abs(tie.weight);
    }
  }
  std::vector<int> contradicted;
  for (size_t v = 0; v < of_view.size(); ++v) {
    if (of_view[v].against_it > ratio * of_view[v].for_it)
      contradicted.push_back(static_cast<int>(v));
  }
  return contradicted;
}

}  // namespace deepuav
