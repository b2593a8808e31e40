#include "deepuav/tracking/pair_measurement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "deepuav/base/random.h"
#include "deepuav/map/frame_motion.h"
#include "support/options_with.h"
#include "support/textured_plane.h"

namespace deepuav {
namespace {

constexpr double kDetectorSigmaPx = 0.3;

/// Two views of a textured plane through a lens, whose key points i show the same, off by the
/// detector's noise.
class MeasurePairsTest : public ::testing::Test {
 protected:
  MeasurePairsTest() {
    for (int v = 40; v <= 200; v += 16) {
      for (int u = 40; u <= 280; u += 16) {
        points_.push_back(world_.Hit({0, 0, 0}, camera_.pinhole.Unproject({u, v})));
        matches_.push_back({static_cast<int>(matches_.size()), static_cast<int>(matches_.size())});
      }
    }
    a_ = View(SE3());
    b_ = View(b_from_a_);
  }

  /// `motion`: turning alone.
  Frame View(const SE3& pose, const ReadoutMotion& motion = {}) {
    Features features{{}, Descriptors(2)};
    const float descriptor[2] = {1, 0};
    for (const Eigen::Vector3d& point : points_) {
      const Eigen::Vector2d image_px =
          *DistortInRow(camera_, camera_.pinhole.Project(pose * point), motion) +
          Eigen::Vector2d(random_.Gaussian(kDetectorSigmaPx), random_.Gaussian(kDetectorSigmaPx));
      features.keypoints.push_back(
          {image_px.cast<float>(), camera_.Undistort(image_px)->cast<float>()});
      features.descriptors.Append(descriptor);
    }
    Frame frame;
    frame.features = std::make_shared<const Features>(features);
    frame.image = std::make_shared<const ImagePyramid>(world_.Render(camera_, pose, motion), 3);
    return WithMotion(std::move(frame), motion, camera_);
  }

  std::vector<PixelPair> Measured(const PatchOptions& options = {}) const {
    std::vector<PixelPair> pairs = DetectedPairs(a_, b_, matches_);
    MeasurePairs(a_, b_, matches_, camera_, options, {kDetectorSigmaPx, turn_sigma_rad_s_}, &pairs);
    return pairs;
  }

  /// How far b's pixel is from what shows there where a's pixel shows it.
  double ErrorPx(const PixelPair& pair) const {
    const Eigen::Vector3d point = world_.Hit({0, 0, 0}, camera_.pinhole.Unproject(pair.a_px));
    return (camera_.pinhole.Project(b_from_a_ * point) - pair.b_px).norm();
  }

  double RmsPx(const std::vector<PixelPair>& pairs) const {
    double squared = 0;
    for (const PixelPair& pair : pairs) squared += ErrorPx(pair) * ErrorPx(pair);
    return std::sqrt(squared / static_cast<double>(pairs.size()));
  }

  Camera camera_{320, 240, {300, 310, 160, 120}, LensModel::kRadialTangential, {-0.1, 0.02, 0, 0},
                 0};
  double turn_sigma_rad_s_ = 0;
  const SE3 b_from_a_{RotationExp({0.02, -0.03, 0.1}), {-0.15, 0.05, -0.2}};
  const TexturedPlane world_;
  Random random_{3};
  std::vector<Eigen::Vector3d> points_;
  std::vector<Match> matches_;
  Frame a_, b_;
};

TEST_F(MeasurePairsTest, AreAsGoodAsPatchesTell) {
  const double detected_px = RmsPx(DetectedPairs(a_, b_, matches_));
  EXPECT_GT(detected_px, kDetectorSigmaPx);
  const std::vector<PixelPair> pairs = Measured();
  ASSERT_EQ(pairs.size(), matches_.size());
  EXPECT_LT(RmsPx(pairs), 0.3 * detected_px);
  int measured = 0;
  for (const PixelPair& pair : pairs) {
    EXPECT_GT(pair.noise_ratio, 0);
    measured += pair.noise_ratio < 0.5;
  }
  EXPECT_GT(measured, 0.9 * static_cast<double>(pairs.size()));
}

TEST_F(MeasurePairsTest, AreAsTheMiddleRowSeesThem) {
  const ReadoutMotion motion_a{{0.01, -0.02, 0.03}, {0, 0, 0}, {0.01, 0, 0.02}},
      motion_b{{-0.03, 0.01, 0.02}, {0, 0, 0}, {0, 0.02, 0}};
  a_ = View(SE3(), motion_a);
  b_ = View(b_from_a_, motion_b);
  EXPECT_LT(RmsPx(Measured()), 0.3 * RmsPx(DetectedPairs(a_, b_, matches_)));
}

TEST_F(MeasurePairsTest, AreNoBetterThanTheTurnIsKnown) {
  const std::vector<PixelPair> known = Measured();
  turn_sigma_rad_s_ = 0.5;
  EXPECT_EQ(Measured()[0].noise_ratio, known[0].noise_ratio) << "all rows are read at once";
  camera_.readout_s = 0.02;
  // The middle row stays where it is; the first and the last are a whole turn apart.
  for (const auto& options : {PatchOptions{}, OptionsWith(&PatchOptions::enabled, false)}) {
    turn_sigma_rad_s_ = 0;
    const std::vector<PixelPair> steady = Measured(options);
    turn_sigma_rad_s_ = 0.5;
    const std::vector<PixelPair> shaking = Measured(options);
    for (size_t i = 0; i < matches_.size(); ++i) {
      const auto far_px = [&](const Frame& frame) {
        const double row = frame.features->keypoints[i].image_px.y();
        return 0.5 * 0.02 * camera_.pinhole.fx * std::abs(row / 239 - 0.5);
      };
      const double unknown_px = std::hypot(far_px(a_), far_px(b_)) / std::sqrt(2.0);
      EXPECT_NEAR(shaking[i].noise_ratio,
                  std::hypot(steady[i].noise_ratio, unknown_px / kDetectorSigmaPx), 1e-4);
      EXPECT_EQ(shaking[i].b_px, steady[i].b_px);
    }
  }
  const std::vector<PixelPair> steady = Measured();
  a_.turn_is_measured = b_.turn_is_measured = true;
  turn_sigma_rad_s_ = 5;
  EXPECT_EQ(Measured()[0].noise_ratio, known[0].noise_ratio) << "a gyroscope told both";
  EXPECT_GT(steady[0].noise_ratio, known[0].noise_ratio);
}

TEST_F(MeasurePairsTest, StayAsDetectedWherePatchesDoNotAgree) {
  const size_t wrong = 50;
  matches_[wrong].b = 120;
  const PixelPair detected = DetectedPairs(a_, b_, matches_)[wrong];
  const PixelPair pair = Measured()[wrong];
  EXPECT_EQ(pair.b_px, detected.b_px);
  EXPECT_EQ(pair.noise_ratio, 1);
}

TEST_F(MeasurePairsTest, StayAsDetectedWithoutImagesAndWithoutPatches) {
  const std::vector<PixelPair> detected = DetectedPairs(a_, b_, matches_);
  PatchOptions disabled;
  disabled.enabled = false;
  EXPECT_EQ(Measured(disabled)[7].b_px, detected[7].b_px);
  for (Frame* frame : {&a_, &b_}) {
    const auto kept = std::exchange(frame->image, nullptr);
    const std::vector<PixelPair> pairs = Measured();
    for (size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_EQ(pairs[i].b_px, detected[i].b_px);
      EXPECT_EQ(pairs[i].noise_ratio, 1);
    }
    frame->image = kept;
  }
}

TEST_F(MeasurePairsTest, OfNothingAreNone) {
  matches_.clear();
  EXPECT_TRUE(Measured().empty());
}

}  // namespace
}  // namespace deepuav
