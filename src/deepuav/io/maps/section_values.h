#pragma once

#include <Eigen/Core>
#include <string>

#include "deepuav/geometry/se3.h"
#include "deepuav/io/files/byte_stream.h"

namespace deepuav {

/// What sections of a map file hold of values that are no numbers. The readers throw Error where
/// the section ends before them.
void PutText(const std::string& text, ByteWriter* writer);
std::string GetText(ByteReader* reader);

void PutVector(const Eigen::Vector3d& vector, ByteWriter* writer);
Eigen::Vector3d GetVector(ByteReader* reader);

/// Seven numbers: the unit quaternion w, x, y, z and the translation, all kept to the bit.
void PutPose(const SE3& pose, ByteWriter* writer);
SE3 GetPose(ByteReader* reader);

}  // namespace deepuav
