#include <utility>
#include <vector>

#include "deepuav/io/maps/map_sections.h"

namespace deepuav {
namespace {

constexpr size_t kKeypointFloats = 6;
constexpr uint32_t kMostPyramidLevels = 16;

}  // namespace

void PutFeatures(KeyframeId keyframe, const Features& features, ByteWriter* writer) {
  PutId(keyframe, writer);
  writer->Put<uint32_t>(static_cast<uint32_t>(features.descriptors.dimension()));
  writer->Put<uint64_t>(features.keypoints.size());
  for (const Keypoint& keypoint : features.keypoints) {
    const float values[kKeypointFloats] = {keypoint.image_px.x(), keypoint.image_px.y(),
                                           keypoint.px.x(),       keypoint.px.y(),
                                           keypoint.score,        keypoint.sigma_px};
    writer->PutAll(std::span<const float>(values));
  }
  writer->PutAll(features.descriptors.scales());
  writer->PutAll(features.descriptors.stored_values());
}

Features GetFeatures(KeyframeId keyframe, std::string_view content) {
  ByteReader reader(content, fmt::format("keyframe {}", keyframe.value));
  const auto id = GetId<KeyframeId>(&reader);
  if (id != keyframe) {
    throw Error("features of keyframe {}: expected those of {}", id.value, keyframe.value);
  }
  const size_t dimension = reader.Get<uint32_t>();
  if (dimension < 1 || dimension > INT32_MAX) {
    throw Error("keyframe {} has descriptors of dimension {}: expected at least 1", keyframe.value,
                dimension);
  }
  const size_t count = reader.GetCount((kKeypointFloats + 1) * sizeof(float) + dimension);
  std::vector<Keypoint> keypoints(count);
  for (Keypoint& keypoint : keypoints) {
    float values[kKeypointFloats];
    reader.GetAll(std::span<float>(values));
    keypoint = {{values[0], values[1]}, {values[2], values[3]}, values[4], values[5]};
  }
  std::vector<float> scales(count);
  reader.GetAll(std::span<float>(scales));
  std::vector<int8_t> stored(count * dimension);
  reader.GetAll(std::span<int8_t>(stored));
  reader.ExpectEnd();
  return {std::move(keypoints), Descriptors::FromStored(static_cast<int>(dimension),
                                                        std::move(stored), std::move(scales))};
}

void PutImage(KeyframeId keyframe, const ImagePyramid* image, ByteWriter* writer) {
  PutId(keyframe, writer);
  writer->Put<uint32_t>(image ? static_cast<uint32_t>(image->levels()) : 0);
  if (!image) return;
  const GreyImage& pixels = image->image();
  writer->Put<uint32_t>(static_cast<uint32_t>(pixels.cols));
  writer->Put<uint32_t>(static_cast<uint32_t>(pixels.rows));
  // Differences of neighbours are small: what compresses the section finds them short.
  std::vector<uint8_t> row(static_cast<size_t>(pixels.cols));
  for (int v = 0; v < pixels.rows; ++v) {
    uint8_t left = 0;
    for (int u = 0; u < pixels.cols; ++u) {
      row[static_cast<size_t>(u)] = static_cast<uint8_t>(pixels(v, u) - left);
      left = pixels(v, u);
    }
    writer->PutAll(std::span<const uint8_t>(row));
  }
}

std::shared_ptr<const ImagePyramid> GetImage(KeyframeId keyframe, std::string_view content) {
  ByteReader reader(content, fmt::format("the image of keyframe {}", keyframe.value));
  const auto id = GetId<KeyframeId>(&reader);
  if (id != keyframe)
    throw Error("image of keyframe {}: expected that of {}", id.value, keyframe.value);
  const uint32_t levels = reader.Get<uint32_t>();
  if (levels > kMostPyramidLevels) {
    throw Error("the image of keyframe {} has {} levels: expected at most {}", keyframe.value,
                levels, kMostPyramidLevels);
  }
  if (levels == 0) {
    reader.ExpectEnd();
    return nullptr;
  }
  const uint64_t width = reader.Get<uint32_t>(), height = reader.Get<uint32_t>();
  if (width < 1 || height < 1 || width * height != reader.left()) {
    throw Error("the image of keyframe {} is {}x{} in {} bytes: expected a byte a pixel",
                keyframe.value, width, height, reader.left());
  }
  GreyImage pixels(static_cast<int>(height), static_cast<int>(width));
  for (int v = 0; v < pixels.rows; ++v) {
    reader.GetAll(std::span<uint8_t>(pixels[v], width));
    for (int u = 1; u < pixels.cols; ++u)
      pixels(v, u) = static_cast<uint8_t>(pixels(v, u) + pixels(v, u - 1));
  }
  reader.ExpectEnd();
  return std::make_shared<const ImagePyramid>(pixels, static_cast<int>(levels));
}

}  // namespace deepuav
