#include "deepuav/system/photos/photo_survey.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/sensors/geodesy.h"
#include "support/synthetic_flight.h"

namespace deepuav {
namespace {

constexpr double kHeight_m = 40, kInterval_s = 2;
const GeoPoint kOrigin{47.4, 8.5, 500};

FeatureWorld Ground() {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksOnGround(2500, {-50, -45}, {120, 95}, 3, &random);
  return FeatureWorld(geometry, 2);
}

/// A survey whose photographs have position fixes: metres of the world are metres east, north and
/// up.
class PhotoSurveyTest : public ::testing::Test {
 protected:
  PhotoSurveyTest() {
    Fly(0.5);
    MeasureFixes(0.3);
    options_.survey.sequence_neighbours = 100;
    options_.sensors.gnss.correlation_s = 0;
  }

  /// About the usual height, positions and views spread by so much.
  void Fly(double spread_m, double turn_rad = 0.06) {
    flight_ = MakeFlight(Ground(), Path(spread_m, turn_rad), {0.5, 0.3, 0.02, 30}, 4);
    flight_.frame_interval_s = kInterval_s;
  }

  void MeasureFixes(double sigma_m) {
    Random random(5);
    sensors_.gnss.fixes.clear();
    for (size_t i = 0; i < flight_.cam_from_world.size(); ++i) {
      const GeoPoint point = GeoFromLocal(kOrigin, Truth(i) + sigma_m * RandomDirection(&random));
      sensors_.gnss.fixes.push_back(
          {{static_cast<int64_t>(1e9 * kInterval_s) * std::ssize(sensors_.gnss.fixes)},
           point.latitude_deg,
           point.longitude_deg,
           point.altitude_m,
           Eigen::Vector3d::Constant(sigma_m)});
    }
  }

  /// Root mean square distance of the cameras from the truth, metres.
  double Error(const SurveyRun& run) const {
    const GeoPoint origin = run.outcome.atlas.GaugeOf(MapId{0}).origin;
    double squares = 0;
    for (size_t i = 0; i < run.result.frames.size(); ++i) {
      const FrameRecord& record = run.result.frames[i];
      EXPECT_TRUE(record.located());
      squares +=
          (LocalFromLocal(kOrigin, origin) * record.cam_from_world.InverseTranslation() - Truth(i))
              .squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(flight_.size()));
  }

  static std::vector<SE3> Path(double spread_m, double turn_rad) {
    Random random(3);
    std::vector<SE3> poses;
    for (const SE3& pose : SurveyPath(3, 5, 14, kHeight_m))
      poses.push_back(Perturbed(pose, spread_m, turn_rad, &random));
    return poses;
  }

  Eigen::Vector3d Truth(size_t i) const { return flight_.cam_from_world[i].InverseTranslation(); }

  SurveyRun Run(const SensorStreams& sensors, double focal_sigma = 0) {
    PreparedFeatures extractor(flight_.features);
    NearestNeighbourMatcher matcher({});
    NumberedImages images(flight_.size(), kInterval_s);
    return RunSurvey(flight_.camera, focal_sigma, options_, Perception{&extractor, &matcher},
                     &images, {.work = work_, .observer = observer_}, sensors);
  }

  SyntheticFlight flight_;
  SensorStreams sensors_;
  SystemOptions options_;
  RunObserver* observer_ = nullptr;
  SurveyTelling::Work work_;
};

TEST_F(PhotoSurveyTest, FixesGiveTheMapItsPlaceOnEarth) {
  const SurveyRun run = Run(sensors_);
  ASSERT_EQ(run.result.failure, "");
  const Gauge gauge = run.outcome.atlas.GaugeOf(MapId{0});
  ASSERT_EQ(gauge.kind, GaugeKind::kGeoreferenced);
  const GeoreferenceReport& report = run.result.georeferences.at(MapId{0});
  EXPECT_EQ(report.used, flight_.size());
  EXPECT_LT(Error(run), 0.3);
}

TEST_F(PhotoSurveyTest, FixesSayWhichPhotographsMayShowTheSameGround) {
  options_.survey.sequence_neighbours = 0;
  EXPECT_TRUE(Run({}).outcome.atlas.Remaining().empty()) << "nothing else says it";
  const SurveyRun run = Run(sensors_);
  ASSERT_EQ(run.result.failure, "");
  EXPECT_EQ(run.outcome.atlas.Remaining().size(), 1u);
  EXPECT_LT(Error(run), 0.3) << "all are located";
}

TEST_F(PhotoSurveyTest, FixesToCentimetresTellTheFocalLength) {
  Fly(8);  // From one height alone, level ground would be as far below as it is short in focus.
  MeasureFixes(0.005);
  const double true_focal_px = flight_.camera.pinhole.fx;
  flight_.camera.pinhole.fx *= 1.02;
  flight_.camera.pinhole.fy *= 1.02;
  const SurveyRun run = Run(sensors_, 0.1);
  ASSERT_EQ(run.result.failure, "");
  ASSERT_EQ(run.outcome.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kGeoreferenced);
  EXPECT_NEAR(run.outcome.camera.pinhole.fx / true_focal_px, 1, 1.5e-3);
  EXPECT_LT(Error(run), 0.04);
}

TEST_F(PhotoSurveyTest, AToldFocalLengthThatIsWrongIsInDoubt) {
  options_.mapping.lens.min_keyframes = 10;
  Fly(8, 0.25);  // Straight down, level ground would be as far below as the focal length is long.
  const Camera told_rightly = flight_.camera;
  for (const double ratio : {1.0, 1.1, 0.9}) {
    flight_.camera = told_rightly;
    flight_.camera.pinhole.fx *= ratio;
    flight_.camera.pinhole.fy *= ratio;
    const SurveyRun run = Run({});
    ASSERT_EQ(run.result.failure, "");
    EXPECT_EQ(run.outcome.camera.pinhole.fx, flight_.camera.pinhole.fx) << "it is kept";
    const std::optional<FocalDoubt>& doubt = run.result.focal_doubt;
    ASSERT_EQ(doubt.has_value(), ratio != 1) << ratio;
    if (!doubt) continue;
    EXPECT_LT(std::abs(doubt->ratio * ratio - 1), 0.8 * std::abs(ratio - 1)) << ratio;
    EXPECT_GT(doubt->sigma, 0);
    options_.mapping.lens.enabled = false;
    EXPECT_FALSE(Run({}).result.focal_doubt);
    options_.mapping.lens.enabled = true;
  }
  flight_.camera.pinhole.fx = 1.1 * told_rightly.pinhole.fx;
  flight_.camera.pinhole.fy = 1.1 * told_rightly.pinhole.fy;
  EXPECT_FALSE(Run({}, 0.2).result.focal_doubt) << "a guess is refined";
}

class Watcher : public RunObserver {
 public:
  void OnFrame(const FrameRecord& record, const Frame& frame) override {
    EXPECT_EQ(record.id.value, frames++);
    EXPECT_EQ(frame.id, record.id);
    EXPECT_FALSE(record.located());
    EXPECT_EQ(maps, 0);
  }
  void OnKeyframe(KeyframeEvent event) override {
    ++keyframes;
    landmarks += std::ssize(event.new_landmarks_world);
  }
  void OnMap(const MapEvent& event) override {
    EXPECT_EQ(event.change, MapChange::kStarted);
    ++maps;
  }
  void OnSketch(const MapSketch& sketch) override {
    EXPECT_EQ(maps, 0);
    EXPECT_GE(sketch.cam_from_world.size(), 3u);
    EXPECT_GT(sketch.points_world.size(), 50u);
    ++sketches;
  }
  void OnGauge(MapId /*map*/, int64_t /*revision*/, const Gauge& told) override { gauge = told; }
  void OnMapState(const Map& map) override { shown_landmarks += map.LandmarkCount(); }
  void OnStage(const std::string& /*stage*/, double seconds) override { stages_s += seconds; }

  int64_t frames = 0, keyframes = 0, landmarks = 0, maps = 0, sketches = 0, shown_landmarks = 0;
  double stages_s = 0;
  Gauge gauge;
};

TEST_F(PhotoSurveyTest, IsWatchedAndStaysTheSame) {
  const SurveyRun plain = Run(sensors_);
  Watcher watcher;
  observer_ = &watcher;
  const SurveyRun watched = Run(sensors_);
  const Map& map = watched.outcome.atlas.At(MapId{0});
  ASSERT_EQ(std::ssize(watched.result.frames), std::ssize(plain.result.frames));
  for (size_t i = 0; i < plain.result.frames.size(); ++i) {
    EXPECT_EQ(watched.result.frames[i].cam_from_world.Matrix(),
              plain.result.frames[i].cam_from_world.Matrix());
  }
  EXPECT_EQ(watcher.frames, std::ssize(flight_.features));
  EXPECT_EQ(watcher.maps, 1);
  EXPECT_EQ(watcher.keyframes, map.KeyframeCount());
  EXPECT_EQ(watcher.landmarks, map.LandmarkCount());
  EXPECT_EQ(watcher.shown_landmarks, map.LandmarkCount());
  EXPECT_GE(watcher.sketches, 1);
  EXPECT_EQ(watcher.gauge.kind, GaugeKind::kGeoreferenced);
  EXPECT_GT(watcher.stages_s, 0);
}

TEST_F(PhotoSurveyTest, TellsHowFarItIs) {
  std::map<std::string, int> most;
  work_ = [&](const std::string& what, int done, int total) {
    EXPECT_LE(done, total);
    most[what] = std::max(most[what], done);
  };
  Run({});
  const auto all = static_cast<int>(flight_.size());
  EXPECT_GT(most["pairs"], all);
  EXPECT_EQ(most["photographs in the map"], all);
}

TEST_F(PhotoSurveyTest, WithoutFixesTheMapIsFree) {
  const SurveyRun run = Run({});
  EXPECT_EQ(run.outcome.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kFree);
  EXPECT_TRUE(run.result.georeferences.empty());
  EXPECT_EQ(run.result.frames.size(), flight_.features.size());
}

}  // namespace
}  // namespace deepuav
