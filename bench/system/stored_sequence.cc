#include "stored_sequence.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "deepuav/inference/session.h"

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

/// What the features of a file were made of: one that says anything else is stale.
std::string Origin(const Dataset& dataset, const SuperPointOptions& options) {
  const Camera& camera = dataset.camera();
  const Pinhole& pinhole = camera.pinhole;
  return fmt::format(
      "deepuav stored features 1\nmodel {} sees {} px\n{} images of {} x {} from {} on\n"
      "lens {} {} {} {} [{}]\n{} bytes a key point\n",
      ModelSha256(options.model), options.network_pixels, dataset.size(), camera.width,
      camera.height, dataset.size() > 0 ? dataset.Time(0).nanoseconds : 0, pinhole.fx, pinhole.fy,
      pinhole.cx, pinhole.cy, fmt::join(camera.distortion, " "), sizeof(Keypoint));
}

bool IsFrom(const std::string& origin, std::istream& stream) {
  std::string found(origin.size(), '\0');
  stream.read(found.data(), static_cast<std::streamsize>(found.size()));
  return stream && found == origin;
}

}  // namespace

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
  SuperPointOptions options;
  options.model = model;
  options.faint_keypoints = options.keypoints;
  const std::string origin = Origin(*dataset, options);
  if (std::ifstream stored(file, std::ios::binary); stored && IsFrom(origin, stored)) {
    for (int i = 0; i < dataset->size(); ++i) all.push_back(ReadFeatures(stored));
    return all;
  }
  SuperPoint extractor(dataset->camera(), options, {});
  const std::string unfinished = file + ".unfinished";
  std::ofstream store(unfinished, std::ios::binary);
  store << origin;
  for (int i = 0; i < dataset->size(); ++i) {
    WriteFeatures(store, extractor.Extract(dataset->Load(i)));
  }
  store.close();
  std::filesystem::rename(unfinished, file);
  return LoadOrExtract(dataset, file, model);
}

}  // namespace deepuav
