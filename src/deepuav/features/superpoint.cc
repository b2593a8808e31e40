#include "deepuav/features/superpoint.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/options.h"
#include "deepuav/base/time.h"

namespace deepuav {
namespace {

int RoundUpToCells(int pixels) {
  return (pixels + kSuperPointCell - 1) / kSuperPointCell * kSuperPointCell;
}

bool IsLogits(const TensorShape& shape, int64_t height, int64_t width) {
  return shape ==
         TensorShape{1, kSuperPointLogits, height / kSuperPointCell, width / kSuperPointCell};
}

bool IsHeatMap(const TensorShape& shape, int64_t height, int64_t width) {
  return shape == TensorShape{1, height, width} || shape == TensorShape{1, 1, height, width};
}

bool IsDescriptors(const TensorShape& shape, int64_t height, int64_t width) {
  return shape.size() == 4 && shape[0] == 1 && shape[1] > 1 &&
         shape[2] == height / kSuperPointCell && shape[3] == width / kSuperPointCell;
}

bool NameSaysDescriptors(const std::string& name) { return name.find("desc") != std::string::npos; }

std::string TensorsText(const std::vector<TensorInfo>& tensors) {
  std::string text;
  for (const TensorInfo& tensor : tensors)
    text += (text.empty() ? "" : ", ") + tensor.name + ShapeText(tensor.shape);
  return text;
}

struct OutputNames {
  std::string detector, descriptors;
  bool detector_gives_logits = false;
  int dimension = 0;
};

/// Tells the outputs by their shapes, and by their names where descriptors of 65 values look like
/// logits.
OutputNames RecogniseOutputs(const Session& session, int64_t height, int64_t width) {
  OutputNames names;
  for (const TensorInfo& output : session.outputs()) {
    const bool looks_like_logits = IsLogits(output.shape, height, width);
    if (IsHeatMap(output.shape, height, width)) {
      names.detector = output.name;
      names.detector_gives_logits = false;
    } else if (looks_like_logits && !NameSaysDescriptors(output.name)) {
      if (names.detector.empty()) {
        names.detector = output.name;
        names.detector_gives_logits = true;
      }
    } else if (IsDescriptors(output.shape, height, width)) {
      names.descriptors = output.name;
      names.dimension = static_cast<int>(output.shape[1]);
    }
  }
  if (names.detector.empty() || names.descriptors.empty()) {
    throw Error(
        "{}: the outputs are {}: expected logits [1,65,{},{}] or a heat map [1,{},{}], and "
        "descriptors [1,D,{},{}]",
        session.model().string(), TensorsText(session.outputs()), height / kSuperPointCell,
        width / kSuperPointCell, height, width, height / kSuperPointCell, width / kSuperPointCell);
  }
  return names;
}

std::string OnlyInput(const Session& session) {
  if (session.inputs().size() != 1) {
    throw Error("{}: the inputs are {}: expected one image [1,1,H,W]", session.model().string(),
                TensorsText(session.inputs()));
  }
  return session.inputs().front().name;
}

/// Length of undistorted pixels per pixel of the image as taken, by finite differences from the
/// pixel and its undistorted position.
std::optional<double> UndistortionMagnification(const Camera& camera,
                                                const Eigen::Vector2d& image_px,
                                                const Eigen::Vector2d& undistorted_px) {
  constexpr double kStepPx = 0.1;
  const auto right = camera.Undistort(image_px + Eigen::Vector2d(kStepPx, 0));
  const auto below = camera.Undistort(image_px + Eigen::Vector2d(0, kStepPx));
  if (!right || !below) return std::nullopt;
  Eigen::Matrix2d differences;
  differences << *right - undistorted_px, *below - undistorted_px;
  return std::sqrt(std::abs(differences.determinant())) / kStepPx;
}

}  // namespace

void SuperPointOptions::Check() const {
  if (model.empty()) throw Error("option features.model is empty: expected the file of a network");
  CheckOption(keypoints >= 1, "features.keypoints", keypoints, "at least 1");
  CheckOption(threshold >= 0 && threshold < 1, "features.threshold", threshold, "0 to below 1");
  CheckOption(nms_radius >= 0, "features.nms_radius", nms_radius, "at least 0 px");
  CheckOption(border >= 0, "features.border", border, "at least 0 px");
  CheckOption(subpixel_sigma >= 0 && subpixel_sigma <= kSuperPointCell, "features.subpixel_sigma",
              subpixel_sigma, "0 to 8 px");
  CheckOption(subpixel_max_offset >= 0 && subpixel_max_offset <= 1, "features.subpixel_max_offset",
              subpixel_max_offset, "0 to 1 px");
  CheckOption(sigma > 0, "features.sigma", sigma, "more than 0 px");
}

SuperPoint::SuperPoint(const Camera& camera, const SuperPointOptions& options,
                       const InferenceOptions& inference)
    : camera_(camera),
      options_((options.Check(), options)),
      refiner_(options.subpixel_sigma, options.subpixel_max_offset),
      session_(options.model, inference),
      padded_width_(RoundUpToCells(camera.width)),
      padded_height_(RoundUpToCells(camera.height)),
      input_(static_cast<size_t>(padded_width_) * static_cast<size_t>(padded_height_)) {
  const std::string input = OnlyInput(session_);
  session_.Reshape({{input, {1, 1, padded_height_, padded_width_}}});
  const OutputNames outputs = RecogniseOutputs(session_, padded_height_, padded_width_);
  detector_output_ = outputs.detector;
  descriptor_output_ = outputs.descriptors;
  detector_gives_logits_ = outputs.detector_gives_logits;
  dimension_ = outputs.dimension;
  if (detector_gives_logits_) heat_map_.resize(input_.size());
  session_.Compile({descriptor_output_});
  session_.SetInput(input, input_);
}

std::string SuperPoint::Description() const {
  return fmt::format("{} sha256:{} {}", session_.model().filename().string(), session_.sha256(),
                     session_.precision());
}

void SuperPoint::FillInput(const GreyImage& image) {
  constexpr float kScale = 1.0f / 255;
  float* out = input_.data();
  for (int y = 0; y < padded_height_; ++y, out += padded_width_) {
    const uint8_t* row = image.ptr<uint8_t>(std::min(y, image.rows - 1));
    for (int x = 0; x < image.cols; ++x) out[x] = kScale * static_cast<float>(row[x]);
    std::fill(out + image.cols, out + padded_width_, out[image.cols - 1]);
  }
}

HeatMap SuperPoint::ReadHeatMap() {
  const std::span<const float> values = session_.Output(detector_output_);
  HeatMap map{values.data(), camera_.width, camera_.height, padded_width_};
  if (detector_gives_logits_) {
    LogitsToHeatMap(values, padded_height_ / kSuperPointCell, padded_width_ / kSuperPointCell,
                    heat_map_, &softmax_scratch_);
    map.values = heat_map_.data();
  } else {
    CheckFinite(map);
  }
  return map;
}

std::optional<Keypoint> SuperPoint::MakeKeypoint(const Eigen::Vector2f& image_px,
                                                 float score) const {
  const Eigen::Vector2d px = image_px.cast<double>();
  const auto undistorted = camera_.Undistort(px);
  if (!undistorted) return std::nullopt;
  const auto magnification = UndistortionMagnification(camera_, px, *undistorted);
  if (!magnification) return std::nullopt;
  return Keypoint{image_px, undistorted->cast<float>(), score,
                  static_cast<float>(options_.sigma * *magnification)};
}

Features SuperPoint::Describe(const HeatMap& heat_map) {
  const PeakOptions peak_options{options_.keypoints, static_cast<float>(options_.threshold),
                                 options_.nms_radius, options_.border};
  const DescriptorMap map{session_.Output(descriptor_output_).data(),
                          padded_height_ / kSuperPointCell, padded_width_ / kSuperPointCell,
                          dimension_};
  const std::vector<Peak> peaks = FindPeaks(heat_map, peak_options);
  Features features{{}, Descriptors(dimension_)};
  features.keypoints.reserve(peaks.size());
  features.descriptors.Reserve(static_cast<int>(peaks.size()));
  std::vector<float> descriptor(static_cast<size_t>(dimension_));
  for (const Peak& peak : peaks) {
    const Eigen::Vector2f centre(static_cast<float>(peak.x), static_cast<float>(peak.y));
    const Eigen::Vector2f image_px = options_.subpixel ? refiner_.Refine(heat_map, peak) : centre;
    const auto keypoint = MakeKeypoint(image_px, peak.score);
    if (!keypoint) continue;
    SampleDescriptor(map, image_px, descriptor);
    features.keypoints.push_back(*keypoint);
    features.descriptors.Append(descriptor);
  }
  return features;
}

Features SuperPoint::Extract(const GreyImage& image, ExtractionTimes* times) {
  if (image.cols != camera_.width || image.rows != camera_.height) {
    throw Error("the image has {}x{} pixels: expected the camera's {}x{}", image.cols, image.rows,
                camera_.width, camera_.height);
  }
  Stopwatch stopwatch;
  FillInput(image);
  session_.Run();
  const double network_s = stopwatch.Seconds();
  stopwatch.Restart();
  Features features = Describe(ReadHeatMap());
  if (times) *times = {network_s, stopwatch.Seconds()};
  return features;
}

}  // namespace deepuav
