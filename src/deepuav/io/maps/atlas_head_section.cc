#include <span>

#include "deepuav/base/error.h"
#include "deepuav/io/maps/map_sections.h"
#include "deepuav/io/maps/section_values.h"

namespace deepuav {
namespace {

LensModel LensFromNumber(uint32_t number) {
  switch (number) {
    case 0:
      return LensModel::kPinhole;
    case 1:
      return LensModel::kRadialTangential;
    case 2:
      return LensModel::kEquidistant;
  }
  throw Error("the camera has the lens model {}: expected 0, 1 or 2", number);
}

uint32_t NumberOfLens(LensModel lens) {
  switch (lens) {
    case LensModel::kPinhole:
      return 0;
    case LensModel::kRadialTangential:
      return 1;
    case LensModel::kEquidistant:
      return 2;
  }
  throw Error("the camera has an unknown lens model");
}

Camera GetCamera(ByteReader* reader) {
  Camera camera;
  camera.width = reader->Get<int32_t>();
  camera.height = reader->Get<int32_t>();
  camera.lens = LensFromNumber(reader->Get<uint32_t>());
  for (double* value : {&camera.pinhole.fx, &camera.pinhole.fy, &camera.pinhole.cx,
                        &camera.pinhole.cy, &camera.rate_hz}) {
    *value = reader->Get<double>();
  }
  camera.distortion.resize(reader->GetCount(sizeof(double)));
  reader->GetAll(std::span<double>(camera.distortion));
  camera.Check("the camera");
  return camera;
}

void PutCamera(const Camera& camera, ByteWriter* writer) {
  writer->Put<int32_t>(camera.width);
  writer->Put<int32_t>(camera.height);
  writer->Put<uint32_t>(NumberOfLens(camera.lens));
  for (double value : {camera.pinhole.fx, camera.pinhole.fy, camera.pinhole.cx, camera.pinhole.cy,
                       camera.rate_hz}) {
    writer->Put<double>(value);
  }
  writer->Put<uint64_t>(camera.distortion.size());
  writer->PutAll(std::span<const double>(camera.distortion));
}

}  // namespace

void PutAtlasHead(const AtlasHead& head, ByteWriter* writer) {
  PutCamera(head.camera, writer);
  writer->Put<int64_t>(head.ids.keyframes);
  writer->Put<int64_t>(head.ids.landmarks);
  writer->Put<uint64_t>(head.maps);
  PutText(head.program, writer);
  PutText(head.features, writer);
  PutText(head.matcher, writer);
}

AtlasHead GetAtlasHead(std::string_view content) {
  ByteReader reader(content, "the atlas");
  AtlasHead head;
  head.camera = GetCamera(&reader);
  head.ids.keyframes = reader.Get<int64_t>();
  head.ids.landmarks = reader.Get<int64_t>();
  head.maps = reader.Get<uint64_t>();
  head.program = GetText(&reader);
  head.features = GetText(&reader);
  head.matcher = GetText(&reader);
  reader.ExpectEnd();
  return head;
}

}  // namespace deepuav
