#include "deepuav/survey/survey_map.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>

#include "deepuav/patches/patch_measurement.h"

namespace deepuav {
namespace {

std::vector<size_t> ByFallingScore(const Features& features) {
  std::vector<size_t> order(features.keypoints.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, std::greater{},
                           [&](size_t i) { return features.keypoints[i].score; });
  return order;
}

/// By view and key point.
std::vector<std::vector<uint8_t>> WhatShowsLandmarks(const std::vector<SurveyView>& views,
                                                     const BuiltSurvey& survey) {
  std::vector<std::vector<uint8_t>> shows;
  shows.reserve(views.size());
  for (const SurveyView& view : views) shows.emplace_back(view.frame.features->keypoints.size(), 0);
  for (size_t t = 0; t < survey.tracks.tracks.size(); ++t) {
    if (!survey.state.points[t]) continue;
    const std::vector<Track::Sight>& sights = survey.tracks.tracks[t].sights;
    for (size_t s = 0; s < sights.size(); ++s) {
      if (survey.state.agrees[t][s])
        shows[static_cast<size_t>(sights[s].view)][static_cast<size_t>(sights[s].keypoint)] = 1;
    }
  }
  return shows;
}

/// The features as the refined camera sees them, and where each key point went (-1: its pixel has
/// no undistorted one, or it was seen at a part of the size and shows no landmark).
struct UndistortedFeatures {
  std::shared_ptr<const Features> features;
  std::vector<int> index;
};

UndistortedFeatures Undistorted(const SurveyView& view, const std::vector<uint8_t>& shows_landmark,
                                const Camera& camera) {
  const Features& features = *view.frame.features;
  const auto as_it_is = static_cast<size_t>(view.FeaturesAt(0).size());
  auto undistorted =
      std::make_shared<Features>(Features{{}, Descriptors(features.descriptors.dimension())});
  std::vector<int> index(features.keypoints.size(), -1);
  for (const size_t i : ByFallingScore(features)) {
    if (i >= as_it_is && !shows_landmark[i]) continue;
    Keypoint keypoint = features.keypoints[i];
    const auto px = camera.Undistort(keypoint.image_px.cast<double>());
    if (!px) continue;
    keypoint.px = px->cast<float>();
    index[i] = undistorted->size();
    undistorted->keypoints.push_back(keypoint);
    undistorted->descriptors.AppendFrom(features.descriptors, static_cast<int>(i));
  }
  return {std::move(undistorted), std::move(index)};
}

struct Sighting {
  int keypoint;
  LandmarkId landmark;
  std::optional<PixelMeasurement> measured;
};

/// What each keyframe sees.
using Sightings = std::vector<std::vector<Sighting>>;

/// Where the pixel would be, had all rows been read at once.
SightPixel AtOnce(SightPixel pixel, const Eigen::Vector3d& point, int view,
                  const SurveyState& state) {
  const Eigen::Vector3d rolling = state.InCamera(point, view, pixel.px.y());
  const Eigen::Vector3d still = *state.cam_from_world[static_cast<size_t>(view)] * point;
  if (rolling.z() > 0 && still.z() > 0)
    pixel.px += state.lens.camera.Project(still) - state.lens.camera.Project(rolling);
  return pixel;
}

/// What a patch found, as the refined camera sees it; nothing where none did.
std::optional<PixelMeasurement> MeasurementOf(const SightPixel& pixel, const Camera& camera,
                                              bool keeps_distortion) {
  if (!pixel.by_patch) return std::nullopt;
  if (!keeps_distortion) return PixelMeasurement{pixel.px.cast<float>(), pixel.noise, true};
  const auto px = camera.Undistort(pixel.px);
  return px ? Undistorted(pixel.px, pixel.noise, {pixel.px, *px}, camera) : std::nullopt;
}

/// Adds the landmarks, without observations yet.
Sightings AddLandmarks(const BuiltSurvey& survey, const std::vector<KeyframeId>& keyframes,
                       const std::vector<std::vector<int>>& index, const Camera& camera,
                       bool keeps_distortion, Map* map, IdSource* ids) {
  Sightings sightings(keyframes.size());
  const auto& [tracks, state, px] = survey;
  for (size_t t = 0; t < tracks.tracks.size(); ++t) {
    if (!state.points[t]) continue;
    std::vector<std::pair<size_t, Sighting>> seen;  // by view
    for (size_t s = 0; s < tracks.tracks[t].sights.size(); ++s) {
      const Track::Sight& sight = tracks.tracks[t].sights[s];
      const auto view = static_cast<size_t>(sight.view);
      if (!state.agrees[t][s] || !keyframes[view].valid()) continue;
      const auto detected = static_cast<size_t>(sight.keypoint);
      const int keypoint = index[view][detected];
      if (keypoint < 0) continue;
      const SightPixel pixel = AtOnce(px[view][detected], *state.points[t], sight.view, state);
      seen.push_back({view, {keypoint, {}, MeasurementOf(pixel, camera, keeps_distortion)}});
    }
    if (seen.size() < 2) continue;
    const LandmarkId landmark = ids->NextLandmark();
    map->AddLandmark(landmark, *state.points[t], keyframes[seen.back().first]);
    for (auto& [view, sighting] : seen) {
      sighting.landmark = landmark;
      sightings[view].push_back(sighting);
    }
    const auto count = static_cast<int>(seen.size());
    map->CountViews(landmark, count, count);
  }
  return sightings;
}

}  // namespace

std::vector<KeyframeId> AddSurveyMap(const std::vector<SurveyView>& views,
                                     const BuiltSurvey& survey, const Camera& camera,
                                     bool keeps_distortion, Atlas* atlas) {
  const SurveyState& state = survey.state;
  Map map(atlas->NextMap());
  map.SetModelSigma(state.model_sigma_px);
  std::vector<KeyframeId> keyframes(views.size());
  std::vector<std::vector<int>> index(views.size());
  const std::vector<std::vector<uint8_t>> shows_landmark = WhatShowsLandmarks(views, survey);
  for (size_t v = 0; v < views.size(); ++v) {
    if (!state.cam_from_world[v]) continue;
    UndistortedFeatures undistorted = Undistorted(views[v], shows_landmark[v], camera);
    Frame frame = views[v].frame;
    frame.features = std::move(undistorted.features);
    frame.image.reset();  // thousands of photographs would not fit into memory
    index[v] = std::move(undistorted.index);
    keyframes[v] = atlas->ids().NextKeyframe();
    map.AddKeyframe(keyframes[v], frame, *state.cam_from_world[v]);
  }
  const Sightings sightings =
      AddLandmarks(survey, keyframes, index, camera, keeps_distortion, &map, &atlas->ids());
  KeyframeId previous;
  for (size_t v = 0; v < views.size(); ++v) {
    if (!keyframes[v].valid()) continue;
    for (const auto& [keypoint, landmark, measured] : sightings[v])
      map.AddObservation(keyframes[v], keypoint, landmark, measured);
    // Only those before it see a landmark by now: no circle can arise.
    if (previous.valid()) map.ConnectToParent(keyframes[v], previous);
    previous = keyframes[v];
  }
  std::vector<LandmarkId> landmarks;
  map.landmarks().ForEach([&](const Landmark& landmark) { landmarks.push_back(landmark.id); });
  for (const LandmarkId landmark : landmarks) map.UpdateAppearance(landmark);
  map.Transform(Sim3(map.At(map.root()).cam_from_world));
  const double depth = map.MedianDepth(map.root());
  if (depth > 0) map.Rescale(1 / depth);
  atlas->Add(std::move(map));
  return keyframes;
}

}  // namespace deepuav
