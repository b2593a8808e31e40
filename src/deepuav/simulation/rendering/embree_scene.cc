#include "deepuav/simulation/rendering/embree_scene.h"

#include <algorithm>
#include <cstring>

#include "deepuav/base/error.h"

namespace deepuav {

EmbreeDevice MakeEmbreeDevice() {
#if defined(__x86_64__)
  EmbreeDevice device(rtcNewDevice("isa=avx2,threads=1"));
#else
  EmbreeDevice device(rtcNewDevice("threads=1"));
#endif
  if (!device) {
    throw Error("Embree does not start: error {}", static_cast<int>(rtcGetDeviceError(nullptr)));
  }
  return device;
}

void CheckEmbree(RTCDevice device, const char* step) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE)
    throw Error("Embree fails at {}: error {}", step, static_cast<int>(error));
}

uint32_t AddTriangles(RTCDevice device, RTCScene scene,
                      const std::vector<Eigen::Vector3f>& vertices,
                      const std::vector<Eigen::Vector3<uint32_t>>& triangles) {
  static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(Eigen::Vector3<uint32_t>) == 12);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertex_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                RTC_FORMAT_FLOAT3, 12, vertices.size());
  void* index_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                               12, triangles.size());
  CheckEmbree(device, "the buffers of a mesh");
  std::memcpy(vertex_buffer, vertices.data(), 12 * vertices.size());
  std::memcpy(index_buffer, triangles.data(), 12 * triangles.size());
  rtcCommitGeometry(geometry);
  const uint32_t number = rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  return number;
}

EmbreeScene MakePrototypeScene(RTCDevice device, const FaceMesh& mesh) {
  EmbreeScene scene(rtcNewScene(device));
  AddTriangles(device, scene.get(), mesh.vertices, mesh.triangles);
  rtcCommitScene(scene.get());
  CheckEmbree(device, "the scene of a mesh");
  return scene;
}

uint32_t AddInstance(RTCDevice device, RTCScene scene, RTCScene prototype, const Placement& from,
                     const Placement* to) {
  RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, prototype);
  rtcSetGeometryTimeStepCount(instance, to != nullptr ? 2 : 1);
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, from.data());
  if (to != nullptr)
    rtcSetGeometryTransform(instance, 1, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, to->data());
  rtcCommitGeometry(instance);
  const uint32_t number = rtcAttachGeometry(scene, instance);
  rtcReleaseGeometry(instance);
  return number;
}

}  // namespace deepuav
