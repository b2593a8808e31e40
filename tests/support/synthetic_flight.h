#pragma once

#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "deepuav/features/extractor.h"
#include "deepuav/system/frames/image_source.h"
#include "support/synthetic_features.h"

namespace deepuav {

/// The features of every frame of a flight, prepared, and where the camera truly was.
struct SyntheticFlight {
  std::vector<SE3> cam_from_world;
  std::vector<Features> features;
  Camera camera;
  double frame_interval_s = 0.05;

  int size() const { return static_cast<int>(features.size()); }
};

inline SyntheticFlight MakeFlight(const FeatureWorld& world, const std::vector<SE3>& path,
                                  const FeatureNoise& noise, uint64_t seed) {
  Random random(seed);
  SyntheticFlight flight{path, {}, world.camera()};
  for (const SE3& pose : path)
    flight.features.push_back(*world.View(pose, noise, &random).features);
  return flight;
}

/// Images that show nothing but their number.
class NumberedImages : public ImageSource {
 public:
  NumberedImages(int count, double interval_s, int throws_at = -1)
      : count_(count), interval_s_(interval_s), throws_at_(throws_at) {}

  std::optional<TimedImage> Next() override {
    if (next_ == throws_at_) throw std::runtime_error("the disk is gone");
    if (next_ == count_) return std::nullopt;
    const int number = next_++;
    GreyImage image(1, 2);
    image(0, 0) = static_cast<uint8_t>(number % 256);
    image(0, 1) = static_cast<uint8_t>(number / 256);
    ++read_;
    return TimedImage{FrameId{number}, TimeOf(number), image};
  }
  std::optional<Timestamp> UpcomingTime(int ahead) const override {
    if (next_ + ahead >= count_) return std::nullopt;
    return TimeOf(next_ + ahead);
  }
  void Skip() override { ++next_; }
  int read() const { return read_; }

 private:
  Timestamp TimeOf(int number) const {
    return Timestamp{static_cast<int64_t>(1e9 * interval_s_ * number)};
  }

  const int count_;
  const double interval_s_;
  const int throws_at_;
  int next_ = 0, read_ = 0;
};

/// Gives the prepared features of a numbered image.
class PreparedFeatures : public Extractor {
 public:
  explicit PreparedFeatures(const std::vector<Features>& features) : features_(features) {}

  Features Extract(const GreyImage& image, ExtractionTimes* times) override {
    if (times) *times = {0.002, 0.001};
    return features_.at(image(0, 0) + size_t{256} * image(0, 1));
  }
  std::string Description() const override { return "prepared"; }

 private:
  const std::vector<Features>& features_;
};

}  // namespace deepuav
