#include "deepuav/io/maps/map_sections.h"

#include <span>

#include "deepuav/io/maps/section_values.h"

namespace deepuav {
namespace {

constexpr size_t kPoseBytes = 7 * 8;
constexpr size_t kKeyframeBytes = 6 * 8 + kPoseBytes;
constexpr size_t kCulledBytes = 4 * 8 + kPoseBytes;
constexpr size_t kMergedBytes = 2 * 8;
constexpr size_t kKeypointReferenceBytes = 8 + 4;
constexpr size_t kMeasurementFloats = 5;
constexpr size_t kMeasurementBytes = kMeasurementFloats * sizeof(float) + 1;
constexpr size_t kNormalBytes = 3 * 8;
constexpr size_t kLandmarkBytes = 2 * 8 + 8 * 8 + kKeypointReferenceBytes + 2 * 4 + 8;
constexpr size_t kImageNameBytes = 2 * 8;

using ImageNames = std::map<KeyframeId, std::string>;

/// Which key point of which keyframe.
void PutKeypointReference(const Observation& observation, ByteWriter* writer) {
  PutId(observation.keyframe, writer);
  writer->Put<int32_t>(observation.keypoint);
}

Observation GetKeypointReference(ByteReader* reader) {
  const auto keyframe = GetId<KeyframeId>(reader);
  return {keyframe, reader->Get<int32_t>(), {}};
}

void PutObservation(const Observation& observation, ByteWriter* writer) {
  PutKeypointReference(observation, writer);
  const PixelMeasurement& measured = observation.measured;
  const float values[kMeasurementFloats] = {measured.px.x(), measured.px.y(), measured.noise.xx,
                                            measured.noise.xy, measured.noise.yy};
  writer->PutAll(std::span<const float>(values));
  writer->Put<uint8_t>(measured.by_patch ? 1 : 0);
}

Observation GetObservation(uint32_t version, ByteReader* reader) {
  Observation observation = GetKeypointReference(reader);
  if (version == kOldestMapFileVersion) return observation;
  float values[kMeasurementFloats];
  reader->GetAll(std::span<float>(values));
  observation.measured.px = {values[0], values[1]};
  observation.measured.noise.xx = values[2];
  observation.measured.noise.xy = values[3];
  observation.measured.noise.yy = values[4];
  const auto by_patch = reader->Get<uint8_t>();
  if (by_patch > 1) {
    throw Error("key point {} of keyframe {} was measured by {}: expected 0 or 1",
                observation.keypoint, observation.keyframe.value, by_patch);
  }
  observation.measured.by_patch = by_patch == 1;
  return observation;
}

size_t ObservationBytes(uint32_t version) {
  return kKeypointReferenceBytes + (version == kOldestMapFileVersion ? 0 : kMeasurementBytes);
}

size_t LandmarkBytes(uint32_t version) {
  return kLandmarkBytes + (version >= kFirstWithNormals ? kNormalBytes : 0);
}

void PutKeyframe(const Keyframe& keyframe, ByteWriter* writer) {
  PutId(keyframe.id, writer);
  PutId(keyframe.frame.id, writer);
  writer->Put<int64_t>(keyframe.frame.time.nanoseconds);
  PutId(keyframe.parent, writer);
  PutPose(keyframe.cam_from_world, writer);
  writer->Put<double>(keyframe.scale);
  writer->Put<uint64_t>(keyframe.loops.size());
  for (KeyframeId other : keyframe.loops) PutId(other, writer);
}

Keyframe GetKeyframe(ByteReader* reader) {
  Keyframe keyframe;
  keyframe.id = GetId<KeyframeId>(reader);
  keyframe.frame.id = GetId<FrameId>(reader);
  keyframe.frame.time = {reader->Get<int64_t>()};
  keyframe.parent = GetId<KeyframeId>(reader);
  keyframe.cam_from_world = GetPose(reader);
  keyframe.scale = reader->Get<double>();
  for (size_t left = reader->GetCount(sizeof(int64_t)); left > 0; --left) {
    const auto other = GetId<KeyframeId>(reader);
    if (!keyframe.loops.empty() && other <= *keyframe.loops.rbegin()) {
      throw Error("keyframe {} closes loops with {} after {}: expected rising ids",
                  keyframe.id.value, other.value, keyframe.loops.rbegin()->value);
    }
    keyframe.loops.insert(keyframe.loops.end(), other);
  }
  return keyframe;
}

void PutLandmark(const Landmark& landmark, ByteWriter* writer) {
  PutId(landmark.id, writer);
  PutId(landmark.created_by, writer);
  PutVector(landmark.position_world, writer);
  PutVector(landmark.mean_view_direction, writer);
  PutVector(landmark.normal_world, writer);
  writer->Put<double>(landmark.min_distance);
  writer->Put<double>(landmark.max_distance);
  PutKeypointReference(landmark.representative, writer);
  writer->Put<int32_t>(landmark.visible);
  writer->Put<int32_t>(landmark.found);
  writer->Put<uint64_t>(landmark.observations.size());
  for (const Observation& observation : landmark.observations) PutObservation(observation, writer);
}

Landmark GetLandmark(uint32_t version, ByteReader* reader) {
  Landmark landmark;
  landmark.id = GetId<LandmarkId>(reader);
  landmark.created_by = GetId<KeyframeId>(reader);
  landmark.position_world = GetVector(reader);
  landmark.mean_view_direction = GetVector(reader);
  if (version >= kFirstWithNormals) landmark.normal_world = GetVector(reader);
  landmark.min_distance = reader->Get<double>();
  landmark.max_distance = reader->Get<double>();
  landmark.representative = GetKeypointReference(reader);
  landmark.visible = reader->Get<int32_t>();
  landmark.found = reader->Get<int32_t>();
  landmark.observations.resize(reader->GetCount(ObservationBytes(version)));
  for (Observation& observation : landmark.observations)
    observation = GetObservation(version, reader);
  return landmark;
}

void PutImageNames(const Map& map, const ImageNames& names, ByteWriter* writer) {
  std::vector<ImageNames::const_iterator> named;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    const auto found = names.find(keyframe.id);
    if (found != names.end()) named.push_back(found);
  });
  writer->Put<uint64_t>(named.size());
  for (const auto& entry : named) {
    PutId(entry->first, writer);
    PutText(entry->second, writer);
  }
}

/// Of some of the keyframes, which come by rising id as the names do.
void GetImageNames(const std::vector<Keyframe>& keyframes, ByteReader* reader, ImageNames* names) {
  auto keyframe = keyframes.begin();
  for (size_t left = reader->GetCount(kImageNameBytes); left > 0; --left) {
    const auto id = GetId<KeyframeId>(reader);
    while (keyframe != keyframes.end() && keyframe->id != id) ++keyframe;
    if (keyframe == keyframes.end()) {
      throw Error("keyframe {} has an image name: expected keyframes of the map by rising id",
                  id.value);
    }
    (*names)[id] = GetText(reader);
    ++keyframe;
  }
}

}  // namespace

void PutMap(const Map& map, MapId id, const ImageNames& image_names, ByteWriter* writer) {
  PutId(id, writer);
  writer->Put<double>(map.model_sigma_px());
  writer->Put<uint64_t>(static_cast<uint64_t>(map.KeyframeCount()));
  map.keyframes().ForEach([&](const Keyframe& keyframe) { PutKeyframe(keyframe, writer); });
  writer->Put<uint64_t>(map.culled().size());
  for (const auto& [keyframe, culled] : map.culled()) {
    PutId(keyframe, writer);
    PutId(culled.pose.keyframe, writer);
    PutPose(culled.pose.cam_from_keyframe, writer);
    writer->Put<double>(culled.pose.keyframe_scale);
    writer->Put<double>(culled.scale);
  }
  writer->Put<uint64_t>(map.merged_into().size());
  for (const auto& [from, into] : map.merged_into()) {
    PutId(from, writer);
    PutId(into, writer);
  }
  writer->Put<uint64_t>(static_cast<uint64_t>(map.LandmarkCount()));
  map.landmarks().ForEach([&](const Landmark& landmark) { PutLandmark(landmark, writer); });
  PutImageNames(map, image_names, writer);
}

MapState GetMap(std::string_view content, uint32_t version, ImageNames* image_names) {
  ByteReader reader(content, "the map");
  MapState state;
  state.id = GetId<MapId>(&reader);
  if (version > kOldestMapFileVersion) state.model_sigma_px = reader.Get<double>();
  for (size_t left = reader.GetCount(kKeyframeBytes); left > 0; --left) {
    state.keyframes.push_back(GetKeyframe(&reader));
  }
  for (size_t left = reader.GetCount(kCulledBytes); left > 0; --left) {
    const auto id = GetId<KeyframeId>(&reader);
    CulledKeyframe culled;
    culled.pose.keyframe = GetId<KeyframeId>(&reader);
    culled.pose.cam_from_keyframe = GetPose(&reader);
    culled.pose.keyframe_scale = reader.Get<double>();
    culled.scale = reader.Get<double>();
    if (!state.culled.try_emplace(id, culled).second) {
      throw Error("keyframe {} was removed twice", id.value);
    }
  }
  for (size_t left = reader.GetCount(kMergedBytes); left > 0; --left) {
    const auto from = GetId<LandmarkId>(&reader), into = GetId<LandmarkId>(&reader);
    if (!state.merged_into.try_emplace(from, into).second) {
      throw Error("landmark {} was merged twice", from.value);
    }
  }
  const size_t landmarks = reader.GetCount(LandmarkBytes(version));
  state.landmarks.reserve(landmarks);
  for (size_t i = 0; i < landmarks; ++i) state.landmarks.push_back(GetLandmark(version, &reader));
  GetImageNames(state.keyframes, &reader, image_names);
  reader.ExpectEnd();
  return state;
}

void MeasureAtKeypoints(MapState* state) {
  std::map<KeyframeId, const Features*> features;
  for (const Keyframe& keyframe : state->keyframes) features[keyframe.id] = &keyframe.features();
  for (Landmark& landmark : state->landmarks) {
    for (Observation& observation : landmark.observations) {
      const auto seen = features.find(observation.keyframe);
      if (seen == features.end() || observation.keypoint < 0 ||
          observation.keypoint >= seen->second->size())
        continue;  // Map::Restore names what is wrong with it.
      const Keypoint& keypoint = seen->second->keypoints[static_cast<size_t>(observation.keypoint)];
      observation.measured = {keypoint.px, keypoint.sigma_px};
    }
  }
}

}  // namespace deepuav
