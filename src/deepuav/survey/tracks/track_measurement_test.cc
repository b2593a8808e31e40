#include "deepuav/survey/tracks/track_measurement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/survey/tracks/track_surfaces.h"
#include "support/textured_plane.h"

namespace deepuav {
namespace {

constexpr double kDetectorSigmaPx = 0.5;

Camera Pinholes() { return {320, 240, {300, 300, 159.5, 119.5}, LensModel::kPinhole, {}, 0}; }

Camera Bent() {
  Camera camera = Pinholes();
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {-0.15, 0.02, 0, 0};
  return camera;
}

/// Photographs of a textured plane from about straight above, one of them turned around, and points
/// on it as a detector finds them.
struct TexturedSurvey {
  explicit TexturedSurvey(const Camera& lens) : camera(lens) {
    const std::vector<SE3> poses = {SE3(), SE3(RotationExp({0.05, 0, 0.1}), {0.4, 0.1, 0}),
                                    SE3(RotationExp({0, 0.06, -0.1}), {-0.3, 0.3, 0.2}),
                                    SE3(RotationExp({0, 0, 3.1}), {0, 0, 0})};
    std::vector<std::shared_ptr<Features>> features;
    for (const SE3& pose : poses) {
      SurveyView& view = views.emplace_back();
      view.frame.image = std::make_shared<ImagePyramid>(plane.Render(camera, pose), 3);
      view.frame.time = {static_cast<int64_t>(views.size()) * 1000000000};
      features.push_back(std::make_shared<Features>(Features{{}, Descriptors(4)}));
      tracks.of_keypoint.emplace_back();
    }
    Random random(5);
    for (double u = 100; u < 230; u += 13) {
      for (double v = 70; v < 180; v += 13) AddPoint(poses, {u, v}, &random, &features);
    }
    for (size_t i = 0; i < views.size(); ++i) views[i].frame.features = features[i];
  }

  void AddPoint(const std::vector<SE3>& poses, const Eigen::Vector2d& px, Random* random,
                std::vector<std::shared_ptr<Features>>* features) {
    const Eigen::Vector3d point = plane.Hit({0, 0, 0}, camera.pinhole.Unproject(px));
    Track track;
    for (size_t i = 0; i < poses.size(); ++i) {
      Keypoint keypoint;
      keypoint.image_px = camera.Distort(poses[i] * point)->cast<float>();
      keypoint.image_px +=
          Eigen::Vector2f(random->Gaussian(kDetectorSigmaPx), random->Gaussian(kDetectorSigmaPx));
      keypoint.px = camera.Undistort(keypoint.image_px.cast<double>())->cast<float>();
      std::vector<Keypoint>& keypoints = (*features)[i]->keypoints;
      track.sights.push_back({static_cast<int>(i), static_cast<int>(keypoints.size())});
      keypoints.push_back(keypoint);
      tracks.of_keypoint[i].push_back(static_cast<int>(tracks.tracks.size()));
    }
    tracks.tracks.push_back(track);
    points.push_back(point);
    cam_from_world = poses;
  }

  SurveyState State() const {
    SurveyState state(tracks, views.size(), {});
    for (size_t i = 0; i < views.size(); ++i) state.cam_from_world[i] = cam_from_world[i];
    for (size_t t = 0; t < points.size(); ++t) {
      state.points[t] = points[t];
      std::fill(state.agrees[t].begin(), state.agrees[t].end(), uint8_t{1});
    }
    return state;
  }

  ViewPixels Detected(bool keeps_distortion) const {
    ViewPixels px;
    for (const SurveyView& view : views) {
      std::vector<SightPixel>& of_view = px.emplace_back();
      for (const Keypoint& keypoint : view.frame.features->keypoints)
        of_view.push_back({(keeps_distortion ? keypoint.image_px : keypoint.px).cast<double>()});
    }
    return px;
  }

  /// How far apart the sights of each point are from where the first shows it, median, px: what the
  /// reference's key point is off by is common to all.
  double MedianDisagreement(const ViewPixels& px, bool keeps_distortion) const {
    std::vector<double> errors;
    for (size_t t = 0; t < points.size(); ++t) {
      std::vector<Eigen::Vector3d> hits;  // on the plane, of the sights measured
      for (size_t i = 0; i < views.size(); ++i) {
        const SightPixel& pixel = px[i][t];
        if (!pixel.by_patch) continue;
        const Eigen::Vector2d at = keeps_distortion ? *camera.Undistort(pixel.px) : pixel.px;
        const SE3 world_from_cam = cam_from_world[i].Inverse();
        const Eigen::Vector3d ray = world_from_cam.rotation() * camera.pinhole.Unproject(at);
        hits.push_back(plane.Hit(world_from_cam.translation(), ray));
      }
      for (size_t k = 1; k < hits.size(); ++k)
        errors.push_back((hits[k] - hits[0]).norm() * camera.pinhole.fx / hits[0].z());
    }
    if (errors.empty()) return 1e9;
    std::nth_element(errors.begin(), errors.begin() + std::ssize(errors) / 2, errors.end());
    return errors[errors.size() / 2];
  }

  TexturedPlane plane;
  Camera camera;
  std::vector<SurveyView> views;
  Tracks tracks;
  std::vector<Eigen::Vector3d> points;
  std::vector<SE3> cam_from_world;
};

class TrackMeasurementTest : public ::testing::TestWithParam<bool> {};

TEST_P(TrackMeasurementTest, SightsAgreeToATenthOfAPixel) {
  const bool keeps_distortion = GetParam();
  const TexturedSurvey survey(keeps_distortion ? Bent() : Pinholes());
  ViewPixels px = survey.Detected(keeps_distortion);
  const int measured = MeasureTracks({&survey.views, survey.camera, keeps_distortion, {}, {}},
                                     survey.tracks, survey.State(), &px);
  EXPECT_GT(measured, 0.6 * static_cast<double>(4 * survey.points.size()));
  EXPECT_LT(survey.MedianDisagreement(px, keeps_distortion), 0.12);
}

INSTANTIATE_TEST_SUITE_P(Pixels, TrackMeasurementTest, ::testing::Values(false, true));

TEST(TrackMeasurement, WithoutImagesOrPatchesNothingMoves) {
  TexturedSurvey survey(Pinholes());
  ViewPixels px = survey.Detected(false);
  PatchOptions off;
  off.enabled = false;
  EXPECT_EQ(MeasureTracks({&survey.views, survey.camera, false, off, {}}, survey.tracks,
                          survey.State(), &px),
            0);
  for (SurveyView& view : survey.views) view.frame.image.reset();
  EXPECT_EQ(MeasureTracks({&survey.views, survey.camera, false, {}, {}}, survey.tracks,
                          survey.State(), &px),
            0);
  EXPECT_EQ(px[1][3].px, survey.Detected(false)[1][3].px);
}

/// Degrees between the plane's normal, towards the cameras, and what is found.
double OffThePlaneDeg(const TexturedSurvey& survey, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d truth = -survey.plane.Normal().normalized();
  return std::atan2(truth.cross(normal).norm(), truth.dot(normal)) * 180 / M_PI;
}

TEST(TrackNormals, AreOfThePlaneThroughThePointsAround) {
  const TexturedSurvey survey(Pinholes());
  SurveyState state = survey.State();
  state.lens.camera.pinhole = survey.camera.pinhole;
  *state.points[20] *= 1.3;  // what lies elsewhere bends nothing around it
  const ViewPixels px = survey.Detected(false);
  std::vector<int> views(survey.points.size(), 1);
  views[3] = -1;
  state.points[4].reset();
  *state.points[5] = {0, 0, -4};
  const auto normals = TrackNormals(survey.tracks, px, state, views, {}, 2);
  for (size_t t = 0; t < normals.size(); ++t) {
    if (t == 20) continue;
    ASSERT_EQ(normals[t].has_value(), t < 3 || t > 5) << t;
    if (!normals[t]) continue;
    EXPECT_NEAR(normals[t]->norm(), 1, 1e-9);
    EXPECT_LT(OffThePlaneDeg(survey, *normals[t]), 6) << t;
  }
  const auto alone = TrackNormals(survey.tracks, px, state, views, {}, 1);
  for (size_t t = 0; t < normals.size(); ++t) EXPECT_EQ(alone[t], normals[t]);
}

TEST(TrackMeasurement, ThePlaneFitsBetterThanASurfaceThatFacesTheCamera) {
  const TexturedSurvey survey(Pinholes());
  SurveyState state = survey.State();
  state.lens.camera.pinhole = survey.camera.pinhole;
  PatchSurvey patches{&survey.views, survey.camera, false, {}, {}};
  ViewPixels on_plane = survey.Detected(false), facing = on_plane;
  MeasureTracks(patches, survey.tracks, state, &on_plane);
  patches.surface.enabled = false;
  MeasureTracks(patches, survey.tracks, state, &facing);
  EXPECT_LT(survey.MedianDisagreement(on_plane, false),
            0.8 * survey.MedianDisagreement(facing, false));
}

TEST(TrackMeasurement, ResidualsTellWhatTheModelLeaves) {
  const TexturedSurvey survey(Pinholes());
  SurveyState state = survey.State();
  state.lens.camera.pinhole = survey.camera.pinhole;
  for (const double sigma_px : {0.05, 0.4}) {
    ViewPixels px = survey.Detected(false);
    Random random(6);
    for (size_t t = 0; t < survey.points.size(); ++t) {
      for (size_t i = 0; i < survey.views.size(); ++i) {
        const Eigen::Vector2d exact =
            survey.camera.pinhole.Project(survey.cam_from_world[i] * survey.points[t]);
        px[i][t] = {exact + Eigen::Vector2d(random.Gaussian(sigma_px), random.Gaussian(sigma_px)),
                    0.01, true};
      }
    }
    // The points are where they are, not adjusted: redundancy is whole.
    const double whole = 1 / std::sqrt(1 - 1.5 / 4);
    EXPECT_NEAR(ModelSigmaPx(survey.tracks, px, state, {}), whole * sigma_px, 0.15 * sigma_px);
  }
}

TEST(ViewVelocities, AreOfTheNeighboursInTimeAndNoneAcrossGaps) {
  const TexturedSurvey survey(Pinholes());
  std::vector<SurveyView> views(6);
  SurveyState state(survey.tracks, views.size(), {});
  const std::vector<int64_t> seconds = {4, 2, 0, 100, 102, 50};  // in any order
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].frame.time = {seconds[i] * 1000000000};
    state.cam_from_world[i] =
        SE3(Eigen::Quaterniond::Identity(), {-3.0 * static_cast<double>(seconds[i]), 0, 0});
  }
  const std::vector<Eigen::Vector3d> velocities = ViewVelocities(views, state);
  for (const size_t i : {0, 1, 2, 3, 4}) EXPECT_NEAR(velocities[i].x(), 3, 1e-9) << i;
  EXPECT_EQ(velocities[5].norm(), 0);
}

}  // namespace
}  // namespace deepuav
