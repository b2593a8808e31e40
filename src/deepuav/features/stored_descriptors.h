#pragma once

#include <cstdint>
#include <optional>

#include "deepuav/base/temporary_file.h"
#include "deepuav/features/descriptors.h"

namespace deepuav {

/// Descriptors that wait in a file until they are asked for. Copies share what is in the file.
class StoredDescriptors {
 public:
  StoredDescriptors() = default;
  /// In `file`, which must outlive it; in memory where it is null, or full.
  StoredDescriptors(Descriptors descriptors, TemporaryFile* file);

  int size() const { return rows_; }
  /// Equal to what was stored. Throws Error where the file cannot be read back.
  Descriptors Load() const;

 private:
  TemporaryFile* file_ = nullptr;
  int64_t at_ = 0;  ///< Values, then scales.
  int rows_ = 0, dimension_ = 0;
  std::optional<Descriptors> in_memory_;
};

}  // namespace deepuav
