#include "deepuav/matching/superglue.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/matching/best_two.h"

namespace deepuav {
namespace {

constexpr char kAssignment[] = "assignment", kLogAssignment[] = "log_assignment";

std::string TensorsText(const std::vector<TensorInfo>& tensors) {
  std::string text;
  for (const TensorInfo& tensor : tensors)
    text += (text.empty() ? "" : ", ") + tensor.name + ShapeText(tensor.shape);
  return text;
}

const TensorInfo* FindTensor(const std::vector<TensorInfo>& tensors, const std::string& name) {
  const auto found = std::find_if(tensors.begin(), tensors.end(),
                                  [&](const TensorInfo& tensor) { return tensor.name == name; });
  return found == tensors.end() ? nullptr : &*found;
}

}  // namespace

void SuperGlueOptions::Check() const { CheckOptions("superglue", *this); }

void SuperGlueOptions::CheckModel() const {
  if (model.empty()) throw Error("option superglue.model is empty: expected the file of a network");
}

InferenceOptions SuperGlueOptions::Inference(InferenceOptions inference) const {
  if (!precision.empty()) inference.precision = precision;
  // What OpenVINO 2026.4 loads from its cache computes something else than what it put there.
  inference.cache_dir.clear();
  return inference;
}

SuperGlueMatcher::SuperGlueMatcher(int width, int height, const SuperGlueOptions& options,
                                   const InferenceOptions& inference)
    : options_((options.Check(), options.CheckModel(), options)),
      session_(options.model, options.Inference(inference)) {
  SetImageSizes({width, height}, {width, height});
  for (size_t i = 0; i < sides_.size(); ++i) {
    const std::string number = std::to_string(i);
    sides_[i].keypoints_name = "keypoints" + number;
    sides_[i].scores_name = "scores" + number;
    sides_[i].descriptors_name = "descriptors" + number;
    sides_[i].mask_name = "mask" + number;
  }
  FixShapes();
  FindOutput();
  session_.Compile();
  for (Side& side : sides_) {
    side.keypoints.resize(2 * network_keypoints_);
    side.scores.resize(network_keypoints_);
    side.descriptors.resize(network_keypoints_ * static_cast<size_t>(dimension_));
    session_.SetInput(side.keypoints_name, side.keypoints);
    session_.SetInput(side.scores_name, side.scores);
    session_.SetInput(side.descriptors_name, side.descriptors);
    if (!has_masks_) continue;
    side.mask.resize(network_keypoints_);
    session_.SetInput(side.mask_name, side.mask);
  }
}

void SuperGlueMatcher::SetImageSizes(const Eigen::Vector2i& a_px, const Eigen::Vector2i& b_px) {
  sides_[0].size_px = a_px.cast<float>();
  sides_[1].size_px = b_px.cast<float>();
}

/// Settles N and D. A network whose N is fixed keeps it.
void SuperGlueMatcher::FixShapes() {
  const std::vector<TensorInfo>& inputs = session_.inputs();
  const auto refuse = [&] {
    return Error(
        "{}: the inputs are {}: expected keypoints0 [1,N,2], scores0 [1,N], descriptors0 [1,N,D], "
        "the same with 1, and mask0 and mask1 [1,N] or neither",
        session_.model().string(), TensorsText(inputs));
  };
  std::set<std::string> names;
  for (const TensorInfo& input : inputs) names.insert(input.name);
  has_masks_ = names.contains(sides_[0].mask_name);
  std::set<std::string> expected;
  for (const Side& side : sides_) {
    expected.insert({side.keypoints_name, side.scores_name, side.descriptors_name});
    if (has_masks_) expected.insert(side.mask_name);
  }
  if (names != expected) throw refuse();

  const TensorShape descriptors = FindTensor(inputs, sides_[0].descriptors_name)->shape;
  if (descriptors.size() != 3 || descriptors[2] < 1) throw refuse();
  const int64_t count = descriptors[1] == kAnySize ? options_.keypoints : descriptors[1];
  dimension_ = static_cast<int>(descriptors[2]);
  network_keypoints_ = static_cast<size_t>(count);
  std::map<std::string, TensorShape> shapes;
  for (const Side& side : sides_) {
    shapes[side.keypoints_name] = {1, count, 2};
    shapes[side.scores_name] = {1, count};
    shapes[side.descriptors_name] = {1, count, dimension_};
    if (has_masks_) shapes[side.mask_name] = {1, count};
  }
  session_.Reshape(shapes);
}

void SuperGlueMatcher::FindOutput() {
  const auto count = static_cast<int64_t>(network_keypoints_);
  for (const std::string name : {kAssignment, kLogAssignment}) {
    const TensorInfo* output = FindTensor(session_.outputs(), name);
    if (!output || output->shape != TensorShape{1, count, count}) continue;
    output_ = name;
    output_is_logarithm_ = name == kLogAssignment;
    return;
  }
  throw Error("{}: the outputs are {}: expected {} or {} [1,{},{}]", session_.model().string(),
              TensorsText(session_.outputs()), kAssignment, kLogAssignment, count, count);
}

std::string SuperGlueMatcher::Description() const {
  return fmt::format("superglue {} sha256:{} {}", session_.model().filename().string(),
                     session_.sha256(), session_.precision());
}

void SuperGlueMatcher::Fill(const Features& features, Side* side) const {
  const size_t count = std::min(static_cast<size_t>(features.size()), network_keypoints_);
  const auto dimension = static_cast<size_t>(dimension_);
  const Eigen::Vector2f centre = 0.5f * side->size_px;
  const float scale = 1 / centre.maxCoeff();
  const auto row = [&](size_t k) {
    return side->descriptors.begin() + static_cast<ptrdiff_t>(k * dimension);
  };
  for (size_t k = 0; k < network_keypoints_; ++k) {
    const bool is_padding = k >= count;
    if (has_masks_) side->mask[k] = is_padding ? 0.0f : 1.0f;
    if (has_masks_ && is_padding) {
      side->keypoints[2 * k] = side->keypoints[2 * k + 1] = side->scores[k] = 0;
      std::fill_n(row(k), dimension, 0.0f);
      continue;
    }
    const size_t from = k % count;
    const Eigen::Vector2f position = scale * (features.keypoints[from].image_px - centre);
    side->keypoints[2 * k] = position.x();
    side->keypoints[2 * k + 1] = position.y();
    side->scores[k] = features.keypoints[from].score;
    if (is_padding) {
      std::copy_n(row(from), dimension, row(k));
    } else {
      features.descriptors.Read(static_cast<int>(k), {&*row(k), dimension});
    }
  }
}

void SuperGlueMatcher::ReadAssignment(size_t count_a, size_t count_b) {
  const std::span<const float> values = session_.Output(output_);
  const size_t rows = has_masks_ ? count_a : network_keypoints_;
  const size_t columns = has_masks_ ? count_b : network_keypoints_;
  assignment_.assign(count_a * count_b, 0);
  float is_finite = 0;  // NaN after a value that is not
  for (size_t i = 0; i < rows; ++i) {
    const float* row = values.data() + i * network_keypoints_;
    float* sums = assignment_.data() + i % count_a * count_b;
    for (size_t j = 0, of = 0; j < columns; ++j, of = of + 1 == count_b ? 0 : of + 1) {
      const float probability = output_is_logarithm_ ? std::exp(row[j]) : row[j];
      is_finite += probability * 0;
      sums[of] += probability;
    }
  }
  if (is_finite != 0) {
    throw Error("{}: the assignment holds a value that is not finite", session_.model().string());
  }
}

std::vector<Match> SuperGlueMatcher::MatchFeatures(const Features& a, const Features& b) {
  for (const Features* features : {&a, &b}) {
    if (features->descriptors.dimension() != dimension_) {
      throw Error("{}: matches descriptors of dimension {}: the features' have {}",
                  session_.model().string(), dimension_, features->descriptors.dimension());
    }
  }
  if (a.size() == 0 || b.size() == 0) return {};
  Fill(a, &sides_[0]);
  Fill(b, &sides_[1]);
  session_.Run();
  const size_t rows = std::min(static_cast<size_t>(a.size()), network_keypoints_);
  const size_t columns = std::min(static_cast<size_t>(b.size()), network_keypoints_);
  ReadAssignment(rows, columns);

  std::vector<BestTwo> best_of_a(rows), best_of_b(columns);
  for (size_t i = 0; i < rows; ++i) {
    for (size_t j = 0; j < columns; ++j) {
      const float probability = assignment_[i * columns + j];
      best_of_a[i].Offer(static_cast<int>(j), probability);
      best_of_b[j].Offer(static_cast<int>(i), probability);
    }
  }
  std::vector<Match> matches;
  for (size_t i = 0; i < rows; ++i) {
    const BestTwo& best = best_of_a[i];
    if (best.index < 0 || !(best.first >= options_.min_score)) continue;
    if (best_of_b[static_cast<size_t>(best.index)].index != static_cast<int>(i)) continue;
    matches.push_back({static_cast<int>(i), best.index, std::min(best.first, 1.0f)});
  }
  return matches;
}

}  // namespace deepuav
