#include "stored_sequence.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

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
  if (std::ifstream stored(file, std::ios::binary); stored) {
    for (int i = 0; i < dataset->size(); ++i) all.push_back(ReadFeatures(stored));
    return all;
  }
  SuperPointOptions options;
  options.model = model;
  options.faint_keypoints = options.keypoints;
  SuperPoint extractor(dataset->camera(), options, {});
  const std::string unfinished = file + ".unfinished";
  std::ofstream store(unfinished, std::ios::binary);
  for (int i = 0; i < dataset->size(); ++i) {
    WriteFeatures(store, extractor.Extract(dataset->Load(i)));
  }
  store.close();
  std::filesystem::rename(unfinished, file);
  return LoadOrExtract(dataset, file, model);
}

}  // namespace deepuav
