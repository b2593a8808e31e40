#include "deepuav/io/maps/section_values.h"

#include <span>

namespace deepuav {

void PutText(const std::string& text, ByteWriter* writer) {
  writer->Put<uint64_t>(text.size());
  writer->PutAll(std::span<const char>(text));
}

std::string GetText(ByteReader* reader) {
  std::string text(reader->GetCount(sizeof(char)), '\0');
  reader->GetAll(std::span<char>(text));
  return text;
}

void PutVector(const Eigen::Vector3d& vector, ByteWriter* writer) {
  writer->PutAll(std::span<const double>(vector.data(), 3));
}

Eigen::Vector3d GetVector(ByteReader* reader) {
  Eigen::Vector3d vector;
  reader->GetAll(std::span<double>(vector.data(), 3));
  return vector;
}

void PutPose(const SE3& pose, ByteWriter* writer) {
  const Eigen::Quaterniond& q = pose.rotation();
  for (double value : {q.w(), q.x(), q.y(), q.z()}) writer->Put<double>(value);
  PutVector(pose.translation(), writer);
}

SE3 GetPose(ByteReader* reader) {
  double wxyz[4];
  reader->GetAll(std::span<double>(wxyz));
  return SE3::FromUnit({wxyz[0], wxyz[1], wxyz[2], wxyz[3]}, GetVector(reader));
}

}  // namespace deepuav
