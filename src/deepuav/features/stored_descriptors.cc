#include "deepuav/features/stored_descriptors.h"

#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace deepuav {

StoredDescriptors::StoredDescriptors(Descriptors descriptors, TemporaryFile* file)
    : file_(file), rows_(descriptors.size()), dimension_(descriptors.dimension()) {
  if (file) {
    const auto values = std::as_bytes(descriptors.stored_values());
    const auto scales = std::as_bytes(descriptors.scales());
    std::vector<std::byte> bytes(values.begin(), values.end());
    bytes.insert(bytes.end(), scales.begin(), scales.end());
    if (const auto at = file->Append(bytes)) {
      at_ = *at;
      return;
    }
  }
  in_memory_ = std::move(descriptors);
}

Descriptors StoredDescriptors::Load() const {
  if (in_memory_) return *in_memory_;
  if (rows_ == 0) return Descriptors();
  std::vector<int8_t> values(static_cast<size_t>(rows_) * static_cast<size_t>(dimension_));
  std::vector<float> scales(static_cast<size_t>(rows_));
  file_->Read(at_, std::as_writable_bytes(std::span(values)));
  file_->Read(at_ + static_cast<int64_t>(values.size()), std::as_writable_bytes(std::span(scales)));
  return Descriptors::FromStored(dimension_, std::move(values), std::move(scales));
}

}  // namespace deepuav
