#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>
#include <vector>

#include "deepuav/base/temporary_file.h"
#include "deepuav/image/pyramid.h"

namespace deepuav {

/// Images of which the last used stay in memory; the others lie as they are in a file without a
/// name, which is gone when the program is, however it ends. Where there is no room for it all stay
/// in memory, and a warning is logged. One thread at a time.
class ImageStore {
 public:
  /// At least 1.
  explicit ImageStore(int most_in_memory);

  /// Gives the number of the image, from 0 on.
  int Add(std::shared_ptr<const ImagePyramid> image);
  /// Equal to what was added, pixel by pixel. Throws Error where the file cannot be read back.
  std::shared_ptr<const ImagePyramid> At(int number);

 private:
  struct Entry {
    std::shared_ptr<const ImagePyramid> image;  ///< Null: in the file alone.
    cv::Size size;
    int levels = 0;
    int64_t at = -1;  ///< Where it begins in the file; below 0: not in it.
    std::list<int>::iterator use;
  };

  void MakeRoom();
  bool Write(Entry* entry);
  std::shared_ptr<const ImagePyramid> Read(const Entry& entry);

  const size_t most_in_memory_;
  std::vector<Entry> entries_;
  std::list<int> in_memory_;  ///< The last used first.
  TemporaryFile file_;
  bool file_fails_ = false;
};

}  // namespace deepuav
