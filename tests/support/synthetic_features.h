#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "deepuav/features/features.h"
#include "support/synthetic_world.h"

namespace deepuav {

/// How far features are from what the landmarks of the world look like.
struct FeatureNoise {
  double sigma_px = 0;       ///< Per axis, normal.
  double descriptor = 0;     ///< Norm of what is added to every descriptor.
  double swapped_ratio = 0;  ///< Share of the key points that carry the descriptor of another.
  int clutter = 0;           ///< Key points that show no landmark.
};

/// The features of one view and what they show.
struct SyntheticView {
  std::shared_ptr<const Features> features;
  std::vector<int> landmark;  ///< One per key point; -1 for clutter.
};

/// A row of unit length in a random direction.
inline std::vector<float> RandomDescriptor(int dimension, Random* random) {
  std::vector<float> row(static_cast<size_t>(dimension));
  float squares = 0;
  for (float& value : row) {
    value = static_cast<float>(random->Gaussian(1));
    squares += value * value;
  }
  for (float& value : row) value /= std::sqrt(squares);
  return row;
}

/// A unit row that differs from the unit row `from` by a random vector of about this norm.
inline std::vector<float> NoisyDescriptor(const std::vector<float>& from, double norm,
                                          Random* random) {
  std::vector<float> row = RandomDescriptor(static_cast<int>(from.size()), random);
  float squares = 0;
  for (size_t k = 0; k < row.size(); ++k) {
    row[k] = from[k] + static_cast<float>(norm) * row[k];
    squares += row[k] * row[k];
  }
  for (float& value : row) value /= std::sqrt(squares);
  return row;
}

inline Keypoint KeypointAt(const Eigen::Vector2d& px) {
  Keypoint keypoint;
  keypoint.px = keypoint.image_px = px.cast<float>();
  keypoint.score = 0.5f;
  return keypoint;
}

/// Key points anywhere in the image with random descriptors: they match nothing.
inline Features RandomFeatures(int count, int width, int height, int dimension, Random* random) {
  Features features{{}, Descriptors(dimension)};
  for (int i = 0; i < count; ++i) {
    const double x = random->Uniform(0, width - 1), y = random->Uniform(0, height - 1);
    features.keypoints.push_back(KeypointAt({x, y}));
    features.descriptors.Append(RandomDescriptor(dimension, random));
  }
  return features;
}

/// A world whose landmarks each have a random unit descriptor.
class FeatureWorld {
 public:
  static constexpr int kDimension = 64;

  FeatureWorld(SyntheticWorld world, uint64_t seed) : world_(std::move(world)) {
    Random random(seed);
    for (size_t i = 0; i < world_.landmarks_world.size(); ++i) {
      descriptors_.push_back(RandomDescriptor(kDimension, &random));
    }
  }

  const SyntheticWorld& world() const { return world_; }
  const std::vector<Eigen::Vector3d>& landmarks() const { return world_.landmarks_world; }

  /// From now on one landmark looks exactly like another.
  void MakeAlike(int landmark, int model) {
    descriptors_[static_cast<size_t>(landmark)] = descriptors_[static_cast<size_t>(model)];
  }

  Camera camera() const {
    Camera camera;
    camera.width = world_.width;
    camera.height = world_.height;
    camera.pinhole = world_.pinhole;
    return camera;
  }

  SyntheticView View(const SE3& cam_from_world, const FeatureNoise& noise, Random* random) const {
    SyntheticView view;
    Features features{{}, Descriptors(kDimension)};
    for (const auto& seen : world_.Observe(cam_from_world, {noise.sigma_px, 0}, random)) {
      features.keypoints.push_back(KeypointAt(seen.px));
      view.landmark.push_back(seen.landmark);
    }
    const std::vector<int> carried = SwapSome(view.landmark, noise.swapped_ratio, random);
    for (int landmark : carried) {
      features.descriptors.Append(
          NoisyDescriptor(descriptors_[static_cast<size_t>(landmark)], noise.descriptor, random));
    }
    const Features clutter =
        RandomFeatures(noise.clutter, world_.width, world_.height, kDimension, random);
    for (int i = 0; i < clutter.size(); ++i) {
      features.keypoints.push_back(clutter.keypoints[static_cast<size_t>(i)]);
      features.descriptors.AppendFrom(clutter.descriptors, i);
      view.landmark.push_back(-1);
    }
    view.features = std::make_shared<const Features>(std::move(features));
    return view;
  }

 private:
  /// Passes the entries of a random share of the places on, each to the next.
  static std::vector<int> SwapSome(std::vector<int> entries, double ratio, Random* random) {
    std::vector<size_t> places;
    for (size_t i = 0; i < entries.size(); ++i) {
      if (random->Uniform(0, 1) < ratio) places.push_back(i);
    }
    for (size_t i = 1; i < places.size(); ++i) std::swap(entries[places[0]], entries[places[i]]);
    return entries;
  }

  SyntheticWorld world_;
  std::vector<std::vector<float>> descriptors_;
};

/// Descriptors on the image turned by 90, 180 and 270 degrees: those of `features` at
/// `upright_turns` quarter turns, random ones at the others, as a network gives that knows
/// one heading only.
inline std::vector<Descriptors> TurnedOf(const Features& features, int upright_turns,
                                         Random* random) {
  std::vector<Descriptors> turned;
  for (int turns = 1; turns < 4; ++turns) {
    turned.push_back(turns == upright_turns
                         ? features.descriptors
                         : RandomFeatures(features.size(), 10, 10, FeatureWorld::kDimension, random)
                               .descriptors);
  }
  return turned;
}

}  // namespace deepuav
