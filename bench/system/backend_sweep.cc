// Runs everything behind the features with several option sets over the same features, extracted once and kept in a
// file, and prints one line each: what an option does to accuracy, without the networks' time.
//
//   backend_sweep DATASET FEATURES_FILE MODEL.onnx ["name=value name=value ..." ...]

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/evaluation/evaluation.h"
#include "deepuav/features/superpoint.h"
#include "deepuav/io/dataset.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/slam.h"

namespace deepuav {
namespace {

template <typename T>
void WriteValue(std::ostream& stream, const T& value) {
  stream.write(reinterpret_cast<const char*>(&value), sizeof(value));
}

template <typename T>
T ReadValue(std::istream& stream) {
  T value{};
  stream.read(reinterpret_cast<char*>(&value), sizeof(value));
  return value;
}

void WriteFeatures(std::ostream& stream, const Features& features) {
  const int dimension = features.descriptors.dimension();
  WriteValue(stream, features.size());
  WriteValue(stream, dimension);
  std::vector<float> row(static_cast<size_t>(dimension));
  for (int i = 0; i < features.size(); ++i) {
    WriteValue(stream, features.keypoints[static_cast<size_t>(i)]);
    features.descriptors.Read(i, row);
    float largest = 0;
    for (float v : row) largest = std::max(largest, std::abs(v));
    WriteValue(stream, largest);
    for (float v : row) WriteValue(stream, static_cast<int8_t>(std::lround(v / largest * 127)));
  }
}

Features ReadFeatures(std::istream& stream) {
  const int count = ReadValue<int>(stream), dimension = ReadValue<int>(stream);
  Features features{{}, Descriptors(dimension)};
  std::vector<float> row(static_cast<size_t>(dimension));
  for (int i = 0; i < count; ++i) {
    features.keypoints.push_back(ReadValue<Keypoint>(stream));
    const float largest = ReadValue<float>(stream);
    for (float& v : row) v = static_cast<float>(ReadValue<int8_t>(stream)) * largest / 127;
    features.descriptors.Append(row);
  }
  return features;
}

/// Gives the frames' features in order of the calls.
class StoredExtractor : public Extractor {
 public:
  explicit StoredExtractor(const std::vector<Features>* features) : features_(features) {}
  Features Extract(const GreyImage& /*image*/, ExtractionTimes* /*times*/) override { return features_->at(next_++); }
  std::string Description() const override { return "stored features"; }

 private:
  const std::vector<Features>* features_;
  size_t next_ = 0;
};

class EmptyImages : public ImageSource {
 public:
  explicit EmptyImages(const Dataset& dataset) : dataset_(dataset) {}
  std::optional<TimedImage> Next() override {
    if (next_ == dataset_.size()) return std::nullopt;
    const int frame = next_++;
    return TimedImage{FrameId{frame}, dataset_.Time(frame), {}};
  }

 private:
  const Dataset& dataset_;
  int next_ = 0;
};

std::vector<Features> LoadOrExtract(Dataset* dataset, const std::string& file, const std::string& model) {
  std::vector<Features> all;
  if (std::ifstream stored(file, std::ios::binary); stored) {
    for (int i = 0; i < dataset->size(); ++i) all.push_back(ReadFeatures(stored));
    return all;
  }
  SuperPointOptions options;
  options.model = model;
  SuperPoint extractor(dataset->camera(), options, {});
  std::ofstream store(file, std::ios::binary);
  for (int i = 0; i < dataset->size(); ++i) {
    WriteFeatures(store, extractor.Extract(dataset->Load(i)));
  }
  store.close();
  return LoadOrExtract(dataset, file, model);
}

Trajectory TrajectoryOf(const SlamResult& result, MapId map) {
  Trajectory trajectory;
  for (const FrameRecord& record : result.frames) {
    if (record.map == map) trajectory.push_back({record.time, record.cam_from_world.Inverse()});
  }
  return trajectory;
}

void RunVariant(const Dataset& dataset, const std::vector<Features>& features, const Truth& truth,
                const std::string& variant) {
  SystemOptions options;
  NearestNeighbourOptions matching;
  OptionRegistry registry;
  RegisterOptions(&options, &registry);
  registry.Add("matching", &matching);
  std::istringstream words(variant);
  for (std::string assignment; words >> assignment;) registry.SetAssignment(assignment);

  StoredExtractor extractor(&features);
  NearestNeighbourMatcher matcher(matching);
  Slam slam(dataset.camera(), options, &extractor, &matcher);
  EmptyImages images(dataset);
  const Stopwatch running;
  const SlamResult result = slam.Run(&images, Schedule::kSequential);
  fmt::print("{}\n", variant.empty() ? "(defaults)" : variant);
  for (const Map& map : slam.atlas().maps()) {
    const Trajectory trajectory = TrajectoryOf(result, map.id());
    EvaluationOptions evaluation;
    evaluation.horizontal = !truth.has_orientation;
    double ate = std::nan("");
    if (trajectory.size() > 5) ate = EvaluateTrajectory(truth, trajectory, evaluation).ate.statistics_m.rmse;
    fmt::print("   map {}: {} frames, {} keyframes, {} landmarks, ATE {:.4f} m\n", map.id().value, trajectory.size(),
               map.KeyframeCount(), map.LandmarkCount(), ate);
  }
  int shown = 0;
  for (const FrameRecord& record : result.frames) {
    if (!record.located() && shown++ < 5) fmt::print("   frame {} has no pose: {}\n", record.id.value, record.reason);
  }
  fmt::print("   {:.1f} s\n", running.Seconds());
  std::fflush(stdout);
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  if (argc < 4) {
    std::cerr << "usage: backend_sweep DATASET FEATURES_FILE MODEL.onnx [\"name=value ...\" ...]\n";
    return 2;
  }
  try {
    const auto dataset = deepuav::OpenDataset(argv[1]);
    const auto features = deepuav::LoadOrExtract(dataset.get(), argv[2], argv[3]);
    const deepuav::Truth truth = deepuav::LoadTruth(argv[1], false);
    std::vector<std::string> variants(argv + 4, argv + argc);
    if (variants.empty()) variants.push_back("");
    for (const std::string& variant : variants) deepuav::RunVariant(*dataset, features, truth, variant);
  } catch (const std::exception& error) {
    std::cerr << "backend_sweep: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
