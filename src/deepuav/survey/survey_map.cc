#include "deepuav/survey/survey_map.h"

#include <memory>

namespace deepuav {
namespace {

/// The features as the refined camera sees them, and where each key point went (-1: its pixel has
/// no undistorted one).
struct UndistortedFeatures {
  std::shared_ptr<const Features> features;
  std::vector<int> index;
};

UndistortedFeatures Undistorted(const Features& features, const Camera& camera) {
  auto undistorted =
      std::make_shared<Features>(Features{{}, Descriptors(features.descriptors.dimension())});
  std::vector<int> index(features.keypoints.size(), -1);
  for (size_t i = 0; i < features.keypoints.size(); ++i) {
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

/// What each keyframe sees: pairs of key point and landmark.
using Sightings = std::vector<std::vector<std::pair<int, LandmarkId>>>;

/// Adds the landmarks, without observations yet.
Sightings AddLandmarks(const Tracks& tracks, const SurveyState& state,
                       const std::vector<KeyframeId>& keyframes,
                       const std::vector<std::vector<int>>& index, Map* map, IdSource* ids) {
  Sightings sightings(keyframes.size());
  for (size_t t = 0; t < tracks.tracks.size(); ++t) {
    if (!state.points[t]) continue;
    std::vector<std::pair<size_t, int>> seen;  // view, key point
    for (size_t s = 0; s < tracks.tracks[t].sights.size(); ++s) {
      const auto view = static_cast<size_t>(tracks.tracks[t].sights[s].view);
      if (!state.agrees[t][s] || !keyframes[view].valid()) continue;
      const int keypoint = index[view][static_cast<size_t>(tracks.tracks[t].sights[s].keypoint)];
      if (keypoint >= 0) seen.emplace_back(view, keypoint);
    }
    if (seen.size() < 2) continue;
    const LandmarkId landmark = ids->NextLandmark();
    map->AddLandmark(landmark, *state.points[t], keyframes[seen.back().first]);
    for (const auto& [view, keypoint] : seen) sightings[view].emplace_back(keypoint, landmark);
    const auto count = static_cast<int>(seen.size());
    map->CountViews(landmark, count, count);
  }
  return sightings;
}

}  // namespace

std::vector<KeyframeId> AddSurveyMap(const std::vector<SurveyView>& views, const Tracks& tracks,
                                     const SurveyState& state, const Camera& camera, Atlas* atlas) {
  Map map(atlas->NextMap());
  std::vector<KeyframeId> keyframes(views.size());
  std::vector<std::vector<int>> index(views.size());
  for (size_t v = 0; v < views.size(); ++v) {
    if (!state.cam_from_world[v]) continue;
    UndistortedFeatures undistorted = Undistorted(*views[v].frame.features, camera);
    Frame frame = views[v].frame;
    frame.features = std::move(undistorted.features);
    index[v] = std::move(undistorted.index);
    keyframes[v] = atlas->ids().NextKeyframe();
    map.AddKeyframe(keyframes[v], frame, *state.cam_from_world[v]);
  }
  const Sightings sightings = AddLandmarks(tracks, state, keyframes, index, &map, &atlas->ids());
  KeyframeId previous;
  for (size_t v = 0; v < views.size(); ++v) {
    if (!keyframes[v].valid()) continue;
    for (const auto& [keypoint, landmark] : sightings[v])
      map.AddObservation(keyframes[v], keypoint, landmark);
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
