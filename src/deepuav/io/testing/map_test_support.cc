#include "deepuav/io/testing/map_test_support.h"

#include <gtest/gtest.h>

#include <cstring>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

std::shared_ptr<const Features> RandomFeatures(int keypoints, int dimension, Random* random) {
  Features features{{}, Descriptors(dimension)};
  features.descriptors.Reserve(keypoints);
  Eigen::VectorXf row(dimension);
  for (int i = 0; i < keypoints; ++i) {
    const auto pixel = [&] { return static_cast<float>(random->Uniform(0, 48)); };
    features.keypoints.push_back({{pixel(), pixel()},
                                  {pixel(), pixel()},
                                  static_cast<float>(random->Uniform(0, 1)),
                                  static_cast<float>(random->Uniform(0.5, 2))});
    for (float& value : row) value = static_cast<float>(random->Uniform(-1, 1));
    row.normalize();
    features.descriptors.Append({row.data(), static_cast<size_t>(dimension)});
  }
  return std::make_shared<const Features>(std::move(features));
}

Eigen::Vector3d RandomVector(Random* random) {
  return {random->Gaussian(1), random->Gaussian(1), random->Gaussian(1)};
}

SE3 RandomPose(Random* random) {
  const Eigen::Vector3d rotation = RandomVector(random);
  return SE3(RotationExp(rotation), RandomVector(random));
}

/// Of the size of TestMapCamera.
std::shared_ptr<const ImagePyramid> RandomImage(Random* random) {
  GreyImage image(48, 64);
  for (uint8_t& pixel : image) pixel = static_cast<uint8_t>(random->Index(256));
  return std::make_shared<const ImagePyramid>(image, 3);
}

PixelMeasurement RandomMeasurement(Random* random) {
  PixelMeasurement measured;
  measured.px = {static_cast<float>(random->Uniform(0, 48)),
                 static_cast<float>(random->Uniform(0, 48))};
  measured.noise.xx = static_cast<float>(random->Uniform(0.5, 1));
  measured.noise.xy = static_cast<float>(random->Uniform(-0.4, 0.4));
  measured.noise.yy = static_cast<float>(random->Uniform(0.5, 1));
  measured.by_patch = random->Index(2) == 1;
  return measured;
}

/// Key point k of five keyframes in a row shows the same landmark.
void AddLandmarks(int keypoints, const std::vector<KeyframeId>& keyframes, Random* random,
                  IdSource* ids, Map* map) {
  constexpr size_t kViews = 5;
  for (size_t first = 0; first + 1 < keyframes.size(); first += kViews - 1) {
    for (int k = static_cast<int>(first % 2); k < keypoints; k += 2) {
      const LandmarkId id = ids->NextLandmark();
      map->AddLandmark(id, RandomVector(random), keyframes[first]);
      for (size_t view = first; view < std::min(first + kViews, keyframes.size()); ++view) {
        map->AddObservation(keyframes[view], k, id, RandomMeasurement(random));
      }
      map->CountViews(id, 7 + k, 3 + k);
      map->SetNormal(id, RandomVector(random).normalized());
    }
  }
}

template <typename T>
bool SameBits(const T& a, const T& b) {
  return std::memcmp(a.data(), b.data(), static_cast<size_t>(a.size()) * sizeof(*a.data())) == 0;
}

void ExpectSamePose(const SE3& a, const SE3& b) {
  EXPECT_TRUE(SameBits(a.rotation().coeffs(), b.rotation().coeffs()));
  EXPECT_TRUE(SameBits(a.translation(), b.translation()));
}

void ExpectSameFeatures(const Features& a, const Features& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.keypoints.size(); ++i) {
    const Keypoint &p = a.keypoints[i], &q = b.keypoints[i];
    ASSERT_TRUE(p.image_px == q.image_px && p.px == q.px && p.score == q.score &&
                p.sigma_px == q.sigma_px);
  }
  const Descriptors &p = a.descriptors, &q = b.descriptors;
  ASSERT_EQ(p.dimension(), q.dimension());
  EXPECT_TRUE(std::ranges::equal(p.stored_values(), q.stored_values()));
  EXPECT_TRUE(std::ranges::equal(p.scales(), q.scales()));
}

void ExpectSameImage(const ImagePyramid* a, const ImagePyramid* b) {
  ASSERT_EQ(a == nullptr, b == nullptr);
  if (!a) return;
  ASSERT_EQ(a->levels(), b->levels());
  for (int level = 0; level < a->levels(); ++level) {
    ASSERT_EQ(a->level(level).size(), b->level(level).size());
    EXPECT_TRUE(
        std::equal(a->level(level).begin(), a->level(level).end(), b->level(level).begin()));
  }
}

void ExpectSameKeyframe(const Keyframe& a, const Keyframe& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.frame.id, b.frame.id);
  EXPECT_EQ(a.frame.time, b.frame.time);
  EXPECT_EQ(a.parent, b.parent);
  EXPECT_EQ(a.scale, b.scale);
  EXPECT_EQ(a.loops, b.loops);
  EXPECT_EQ(a.children, b.children);
  EXPECT_EQ(a.covisible, b.covisible);
  EXPECT_EQ(a.landmarks, b.landmarks);
  ExpectSamePose(a.cam_from_world, b.cam_from_world);
  ExpectSameFeatures(a.features(), b.features());
  ExpectSameImage(a.frame.image.get(), b.frame.image.get());
}

bool SameObservation(const Observation& a, const Observation& b) {
  return a.keyframe == b.keyframe && a.keypoint == b.keypoint;
}

bool SameMeasuredObservation(const Observation& a, const Observation& b) {
  return SameObservation(a, b) && a.measured.px == b.measured.px &&
         a.measured.noise == b.measured.noise && a.measured.by_patch == b.measured.by_patch;
}

void ExpectSameLandmark(const Landmark& a, const Landmark& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.created_by, b.created_by);
  EXPECT_TRUE(SameBits(a.position_world, b.position_world));
  EXPECT_TRUE(SameBits(a.mean_view_direction, b.mean_view_direction));
  EXPECT_TRUE(SameBits(a.normal_world, b.normal_world));
  EXPECT_EQ(a.min_distance, b.min_distance);
  EXPECT_EQ(a.max_distance, b.max_distance);
  EXPECT_EQ(a.visible, b.visible);
  EXPECT_EQ(a.found, b.found);
  EXPECT_TRUE(SameObservation(a.representative, b.representative));
  EXPECT_TRUE(std::ranges::equal(a.observations, b.observations, SameMeasuredObservation));
}

void ExpectSameMap(const Map& a, const Map& b) {
  EXPECT_EQ(a.id(), b.id());
  EXPECT_EQ(a.model_sigma_px(), b.model_sigma_px());
  ASSERT_EQ(a.KeyframeCount(), b.KeyframeCount());
  ASSERT_EQ(a.LandmarkCount(), b.LandmarkCount());
  a.keyframes().ForEach([&](const Keyframe& keyframe) {
    ASSERT_TRUE(b.Contains(keyframe.id));
    ExpectSameKeyframe(keyframe, b.At(keyframe.id));
  });
  a.landmarks().ForEach([&](const Landmark& landmark) {
    ASSERT_TRUE(b.Contains(landmark.id));
    ExpectSameLandmark(landmark, b.At(landmark.id));
  });
  EXPECT_EQ(a.merged_into(), b.merged_into());
  ASSERT_EQ(a.culled().size(), b.culled().size());
  for (const auto& [id, culled] : a.culled()) {
    ASSERT_TRUE(b.culled().contains(id));
    EXPECT_EQ(culled.pose.keyframe, b.culled().at(id).pose.keyframe);
    ExpectSamePose(culled.pose.cam_from_keyframe, b.culled().at(id).pose.cam_from_keyframe);
    EXPECT_EQ(culled.pose.keyframe_scale, b.culled().at(id).pose.keyframe_scale);
    EXPECT_EQ(culled.scale, b.culled().at(id).scale);
  }
}

}  // namespace

Camera TestMapCamera() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.pinhole = {45.5, 46.5, 31.25, 24.75};
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  camera.rate_hz = 20;
  return camera;
}

MapOrigin TestMapOrigin() {
  return {"0.1.0",
          "toy.onnx sha256:0123 fp32",
          "mutual nearest neighbour",
          {{KeyframeId{0}, "000.png"}, {KeyframeId{1}, "a name.png"}, {KeyframeId{3}, ""}}};
}

Map TestMap(MapId id, int keyframes, int keypoints, int dimension, uint64_t seed, IdSource* ids) {
  Random random(seed);
  Map map(id);
  map.SetModelSigma(0.25);
  std::vector<KeyframeId> added;
  for (int i = 0; i < keyframes; ++i) {
    Frame frame{FrameId{10 * i}, Timestamp{1403636579763555584 + 50000000 * int64_t{i}},
                RandomFeatures(keypoints, dimension, &random)};
    if (i == 1) frame.image = RandomImage(&random);
    added.push_back(ids->NextKeyframe());
    map.AddKeyframe(added.back(), frame, RandomPose(&random));
    if (i > 0) map.ConnectToParent(added.back(), added[static_cast<size_t>(i - 1) / 2]);
  }
  AddLandmarks(keypoints, added, &random, ids, &map);
  std::vector<LandmarkId> landmarks;
  map.landmarks().ForEach([&](const Landmark& landmark) { landmarks.push_back(landmark.id); });
  for (const LandmarkId landmark : landmarks) map.UpdateAppearance(landmark);
  if (landmarks.size() > 3) {
    map.MergeLandmark(landmarks[0], landmarks[1]);
    map.MergeLandmark(landmarks[1], landmarks[2]);
    map.RemoveLandmark(landmarks[3]);
  }
  if (added.size() > 5) {
    map.AddLoop(added[0], added[5]);
    map.AddLoop(added[1], added[4]);
    map.Move(added[2], Sim3(1.25, RotationExp({0.1, 0, 0}), {1, 2, 3}));
    map.Move(added[4], Sim3(0.75, RotationExp({0, 0.1, 0}), {3, 2, 1}));
    map.RemoveKeyframe(added[5]);
    map.RemoveKeyframe(added[2]);  // the parent of the one before
  }
  return map;
}

Atlas TestAtlas(int keyframes, int keypoints, int dimension, uint64_t seed) {
  Atlas atlas;
  atlas.Add(TestMap(atlas.NextMap(), keyframes, keypoints, dimension, seed, &atlas.ids()));
  atlas.Add(Map(atlas.NextMap()));
  atlas.Add(TestMap(atlas.NextMap(), keyframes / 2, keypoints, dimension, seed + 1, &atlas.ids()));
  return atlas;
}

void ExpectSameAtlas(const Atlas& a, const Atlas& b) {
  EXPECT_EQ(a.ids().keyframes, b.ids().keyframes);
  EXPECT_EQ(a.ids().landmarks, b.ids().landmarks);
  const std::vector<MapId> maps_a = a.Remaining(), maps_b = b.Remaining();
  ASSERT_EQ(maps_a.size(), maps_b.size());
  for (size_t i = 0; i < maps_a.size(); ++i) ExpectSameMap(a.At(maps_a[i]), b.At(maps_b[i]));
}

}  // namespace deepuav
