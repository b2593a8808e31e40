// Runs everything behind the features with several option sets over the same features, extracted
// once and kept in a file, and prints one line each: what an option does to accuracy, without the
// networks' time.
//
//   backend_sweep DATASET FEATURES_FILE MODEL.onnx VOCABULARY ["name=value name=value ..." ...]
//
// VOCABULARY may be empty (""): no place is recognised then. Beside the program's options, stride=N
// runs every N-th frame, repeat=N shows all of it N times, start=N and end=N a part, drop_from=A
// drop_to=B leaves frames out (a jump of the camera), blind_from=A blind_to=B takes all features
// away, and keypoints=N keeps the best. The file holds faint key points too, so that
// features.threshold and features.faint_keypoints can be varied, but no other options of features.
// With superglue.model=FILE that network matches, as with the program's matching.method=superglue.

#include <fmt/format.h>

#include <algorithm>
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
#include "deepuav/matching/superglue.h"
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

struct Part {
  int start = 0, end = 0, stride = 1, keypoints = 0;
  int drop_from = 0, drop_to = 0;    // left out: the camera jumps
  int blind_from = 0, blind_to = 0;  // without features: the camera sees nothing

  int repeat = 1;  // times that all of it is shown, one after the other

  int Frame(int index) const {
    const int frame = start + index % once() * stride;
    return frame < drop_from ? frame : frame + (drop_to - drop_from);
  }
  int once() const { return (end - start - (drop_to - drop_from) + stride - 1) / stride; }
  int size() const { return repeat * once(); }
  bool IsBlind(int frame) const { return frame >= blind_from && frame < blind_to; }
};

/// Gives the frames' features in order of the calls.
class StoredExtractor : public Extractor {
 public:
  StoredExtractor(const std::vector<Features>* features, const SuperPointOptions& options,
                  const Part& part)
      : features_(features), options_(options), part_(part) {}

  Features Extract(const GreyImage& /*image*/, ExtractionTimes* /*times*/) override {
    const int frame = part_.Frame(next_++);
    const Features& all = features_->at(static_cast<size_t>(frame));
    if (part_.IsBlind(frame)) return Features{{}, Descriptors(all.descriptors.dimension())};
    const int count = CountOf(all);
    Features best{{all.keypoints.begin(), all.keypoints.begin() + count},
                  Descriptors(all.descriptors.dimension())};
    for (int i = 0; i < count; ++i) best.descriptors.AppendFrom(all.descriptors, i);
    return best;
  }
  std::string Description() const override { return "stored features"; }

 private:
  /// As many as the program would find with the options.
  int CountOf(const Features& all) const {
    const auto clear = std::count_if(
        all.keypoints.begin(), all.keypoints.end(),
        [&](const auto& k) { return static_cast<double>(k.score) > options_.threshold; });
    int count = std::min(all.size(), std::max(static_cast<int>(clear), options_.faint_keypoints));
    if (part_.keypoints > 0) count = std::min(count, part_.keypoints);
    return count;
  }

  const std::vector<Features>* features_;
  const SuperPointOptions options_;
  const Part part_;
  int next_ = 0;
};

/// The images themselves: patches are aligned on them.
class PartImages : public ImageSource {
 public:
  PartImages(Dataset* dataset, const Part& part) : dataset_(*dataset), part_(part) {}
  std::optional<TimedImage> Next() override {
    if (next_ == part_.size()) return std::nullopt;
    const int index = next_++;
    return TimedImage{FrameId{index}, TimeOf(index), dataset_.Load(part_.Frame(index))};
  }
  std::optional<Timestamp> UpcomingTime(int ahead) const override {
    if (next_ + ahead >= part_.size()) return std::nullopt;
    return TimeOf(next_ + ahead);
  }
  void Skip() override { ++next_; }

  /// Every repetition follows the one before at the distance of its first two frames.
  Timestamp TimeOf(int index) const {
    const auto time = [this](int i) { return dataset_.Time(part_.Frame(i)).nanoseconds; };
    const int last = part_.once() - 1;
    const int64_t period = time(last) - time(0) + (time(1) - time(0));
    return {time(index % part_.once()) + index / part_.once() * period};
  }

 private:
  Dataset& dataset_;
  const Part part_;
  int next_ = 0;
};

/// Takes the words that name a part of the sequence; false for another.
bool SetPart(const std::string& word, Part* part) {
  const std::map<std::string, int*> fields = {
      {"start", &part->start},      {"end", &part->end},
      {"stride", &part->stride},    {"keypoints", &part->keypoints},
      {"repeat", &part->repeat},    {"drop_from", &part->drop_from},
      {"drop_to", &part->drop_to},  {"blind_from", &part->blind_from},
      {"blind_to", &part->blind_to}};
  const size_t equals = word.find('=');
  const auto field = fields.find(word.substr(0, equals));
  if (field == fields.end()) return false;
  *field->second = std::stoi(word.substr(equals + 1));
  return true;
}

std::vector<Features> LoadOrExtract(Dataset* dataset, const std::string& file,
                                    const std::string& model) {
  std::vector<Features> all;
  if (std::ifstream stored(file, std::ios::binary); stored) {
    for (int i = 0; i < dataset->size(); ++i) all.push_back(ReadFeatures(stored));
    return all;
  }
  SuperPointOptions options;
  options.model = model;
  options.faint_keypoints = options.keypoints;
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

void RunVariant(Dataset* dataset_to_run, const std::vector<Features>& features, const Truth& truth,
                const std::optional<Vocabulary>& vocabulary, const std::string& variant) {
  const Dataset& dataset = *dataset_to_run;
  SystemOptions options;
  NearestNeighbourOptions matching;
  OptionRegistry registry;
  RegisterOptions(&options, &registry);
  registry.Add("matching", &matching);
  SuperPointOptions superpoint;
  registry.Add("features", &superpoint);
  SuperGlueOptions superglue;
  registry.Add("superglue", &superglue);
  std::istringstream words(variant);
  Part part{.end = dataset.size()};
  for (std::string word; words >> word;) {
    if (!SetPart(word, &part)) registry.SetAssignment(word);
  }

  StoredExtractor extractor(&features, superpoint, part);
  NearestNeighbourMatcher matcher(matching);
  Perception perception{&extractor, &matcher, vocabulary ? &*vocabulary : nullptr};
  std::optional<SuperGlueMatcher> learned;
  if (!superglue.model.empty()) {
    learned.emplace(dataset.camera().width, dataset.camera().height, superglue,
                    superglue.Inference({}));
    perception.matcher = &*learned;
    perception.quick_matcher = &matcher;
    perception.matcher_is_learned = true;
  }
  Slam slam(dataset.camera(), options, perception);
  PartImages images(dataset_to_run, part);
  const Stopwatch running;
  const SlamResult result = slam.Run(&images, Schedule::kSequential);
  fmt::print("{}\n", variant.empty() ? "(defaults)" : variant);
  for (MapId id : slam.atlas().Remaining()) {
    const Map& map = slam.atlas().At(id);
    const Trajectory trajectory = TrajectoryOf(result, map.id());
    EvaluationOptions evaluation;
    evaluation.horizontal = !truth.has_orientation;
    double ate = std::nan("");
    if (trajectory.size() > 5)
      ate = EvaluateTrajectory(truth, trajectory, evaluation).ate.statistics_m.rmse;
    fmt::print(
        "   map {}: {} frames, {} keyframes, {} landmarks, ATE {:.4f} m, model noise {:.2f} px\n",
        map.id().value, trajectory.size(), map.KeyframeCount(), map.LandmarkCount(), ate,
        map.model_sigma_px());
  }
  int shown = 0;
  for (const FrameRecord& record : result.frames) {
    if (!record.located() && shown++ < 5)
      fmt::print("   frame {} has no pose: {}\n", record.id.value, record.reason);
  }
  fmt::print("   {} relocalisations, {} loops, {} maps merged; {:.1f} s\n", result.relocalisations,
             result.closed_loops, result.merged_maps, running.Seconds());
  std::fflush(stdout);
}

}  // namespace
}  // namespace deepuav

int main(int argc, char** argv) {
  if (argc < 5) {
    std::cerr << "usage: backend_sweep DATASET FEATURES_FILE MODEL.onnx VOCABULARY "
                 "[\"name=value ...\" ...]\n";
    return 2;
  }
  try {
    const auto dataset = deepuav::OpenDataset(argv[1]);
    const auto features = deepuav::LoadOrExtract(dataset.get(), argv[2], argv[3]);
    const deepuav::Truth truth = deepuav::LoadTruth(argv[1], false);
    std::optional<deepuav::Vocabulary> vocabulary;
    if (*argv[4] != 0) vocabulary = deepuav::Vocabulary::Load(argv[4]);
    std::vector<std::string> variants(argv + 5, argv + argc);
    if (variants.empty()) variants.push_back("");
    for (const std::string& variant : variants)
      deepuav::RunVariant(dataset.get(), features, truth, vocabulary, variant);
  } catch (const std::exception& error) {
    std::cerr << "backend_sweep: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
