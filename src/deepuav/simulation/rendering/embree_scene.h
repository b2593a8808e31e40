#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <vector>

#include "deepuav/simulation/world/face_mesh.h"
#include "deepuav/simulation/world/terrain.h"
#include "deepuav/simulation/world/traffic.h"

namespace deepuav {

template <auto Release>
struct EmbreeDeleter {
  template <typename Object>
  void operator()(Object* object) const {
    Release(object);
  }
};
using EmbreeDevice = std::unique_ptr<RTCDeviceTy, EmbreeDeleter<rtcReleaseDevice>>;
using EmbreeScene = std::unique_ptr<RTCSceneTy, EmbreeDeleter<rtcReleaseScene>>;

/// Throws Error where Embree does not start. It is held to one instruction set, so that what it
/// computes does not depend on the machine, and to the calling thread.
EmbreeDevice MakeEmbreeDevice();

/// Throws Error that names the step when Embree has reported one since the last call.
void CheckEmbree(RTCDevice device, const char* step);

/// Adds triangles, and returns the geometry's number in the scene.
uint32_t AddTriangles(RTCDevice device, RTCScene scene,
                      const std::vector<Eigen::Vector3f>& vertices,
                      const std::vector<Eigen::Vector3<uint32_t>>& triangles);

/// A committed scene of one mesh, to be placed by instances.
EmbreeScene MakePrototypeScene(RTCDevice device, const FaceMesh& mesh);

/// Adds a prototype at a placement, or moving evenly from the first to the second over ray times 0
/// to 1.
uint32_t AddInstance(RTCDevice device, RTCScene scene, RTCScene prototype, const Placement& from,
                     const Placement* to = nullptr);

}  // namespace deepuav
