#include "deepuav/features/superpoint_network.h"

#include <algorithm>
#include <set>
#include <string>

#include "deepuav/base/error.h"

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

}  // namespace

SuperPointNetwork::SuperPointNetwork(int width, int height, const std::string& model,
                                     const InferenceOptions& inference)
    : width_(width),
      height_(height),
      padded_width_(RoundUpToCells(width)),
      padded_height_(RoundUpToCells(height)),
      session_(model, inference),
      input_(static_cast<size_t>(padded_width_) * static_cast<size_t>(padded_height_)) {
  const std::string input = OnlyInput(session_);
  session_.Reshape({{input, {1, 1, padded_height_, padded_width_}}});
  const OutputNames outputs = RecogniseOutputs(session_, padded_height_, padded_width_);
  detector_output_ = outputs.detector;
  descriptor_output_ = outputs.descriptors;
  detector_gives_logits_ = outputs.detector_gives_logits;
  dimension_ = outputs.dimension;
  std::set<std::string> channels_last{descriptor_output_};
  if (detector_gives_logits_) channels_last.insert(detector_output_);
  session_.Compile(channels_last);
  session_.SetInput(input, input_);
}

std::string SuperPointNetwork::Description() const {
  return fmt::format("{} sha256:{} {}", session_.model().filename().string(), session_.sha256(),
                     session_.precision());
}

void SuperPointNetwork::Run(const GreyImage& image) {
  if (image.cols != width_ || image.rows != height_) {
    throw Error("the image has {}x{} pixels: expected the camera's {}x{}", image.cols, image.rows,
                width_, height_);
  }
  FillInput(image);
  session_.Run();
}

void SuperPointNetwork::FillInput(const GreyImage& image) {
  constexpr float kScale = 1.0f / 255;
  float* out = input_.data();
  for (int y = 0; y < padded_height_; ++y, out += padded_width_) {
    const uint8_t* row = image.ptr<uint8_t>(std::min(y, image.rows - 1));
    for (int x = 0; x < image.cols; ++x) out[x] = kScale * static_cast<float>(row[x]);
    std::fill(out + image.cols, out + padded_width_, out[image.cols - 1]);
  }
}

HeatMap SuperPointNetwork::ReadHeatMap() {
  const std::span<const float> values = session_.Output(detector_output_);
  HeatMap map{values.data(), width_, height_, padded_width_};
  if (detector_gives_logits_) {
    heat_map_.resize(input_.size());
    LogitsToHeatMap(values, padded_height_ / kSuperPointCell, padded_width_ / kSuperPointCell,
                    heat_map_, &softmax_scratch_);
    map.values = heat_map_.data();
  } else {
    CheckFinite(map);
  }
  return map;
}

DescriptorMap SuperPointNetwork::ReadDescriptors() {
  const int rows = padded_height_ / kSuperPointCell, columns = padded_width_ / kSuperPointCell;
  const std::span<const float> values = session_.Output(descriptor_output_);
  inverse_lengths_.resize(static_cast<size_t>(rows) * static_cast<size_t>(columns));
  InverseLengths(values, inverse_lengths_);
  return {values.data(), inverse_lengths_.data(), rows, columns, dimension_};
}

}  // namespace deepuav
