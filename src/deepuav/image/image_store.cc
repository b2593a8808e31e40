#include "deepuav/image/image_store.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

/// In a folder that lies on a disk, as /tmp need not. Null, and errno, where there is none.
std::FILE* OpenNamelessFile() {
  const char* folder = std::getenv("TMPDIR");
  std::string name = folder && *folder ? folder : "/var/tmp";
  name += "/deepuav-images-XXXXXX";
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0) return nullptr;
  unlink(name.c_str());
  return fdopen(descriptor, "w+b");
}

}  // namespace

ImageStore::ImageStore(int most_in_memory)
    : most_in_memory_(static_cast<size_t>(std::max(1, most_in_memory))) {}

ImageStore::~ImageStore() {
  if (file_) std::fclose(file_);
}

int ImageStore::Add(std::shared_ptr<const ImagePyramid> image) {
  const int number = static_cast<int>(entries_.size());
  in_memory_.push_front(number);
  const cv::Size size = image->image().size();
  const int levels = image->levels();
  entries_.push_back({std::move(image), size, levels, -1, in_memory_.begin()});
  MakeRoom();
  return number;
}

std::shared_ptr<const ImagePyramid> ImageStore::At(int number) {
  Entry& entry = entries_[static_cast<size_t>(number)];
  if (entry.image) {
    in_memory_.splice(in_memory_.begin(), in_memory_, entry.use);
    return entry.image;
  }
  std::shared_ptr<const ImagePyramid> image = Read(entry);
  entry.image = image;
  in_memory_.push_front(number);
  entry.use = in_memory_.begin();
  MakeRoom();
  return image;
}

void ImageStore::MakeRoom() {
  while (in_memory_.size() > most_in_memory_ && !file_fails_) {
    Entry& oldest = entries_[static_cast<size_t>(in_memory_.back())];
    if (oldest.at < 0 && !Write(&oldest)) {
      Log().warn("images cannot be kept in a temporary file ({}): all stay in memory",
                 std::strerror(errno));
      file_fails_ = true;
      return;
    }
    oldest.image.reset();
    in_memory_.pop_back();
  }
}

bool ImageStore::Write(Entry* entry) {
  if (!file_) file_ = OpenNamelessFile();
  if (!file_ || std::fseek(file_, end_, SEEK_SET) != 0) return false;
  const GreyImage& image = entry->image->image();
  const auto columns = static_cast<size_t>(image.cols);
  for (int y = 0; y < image.rows; ++y) {
    if (std::fwrite(image.ptr(y), 1, columns, file_) != columns) return false;
  }
  if (std::fflush(file_) != 0) return false;
  entry->at = end_;
  end_ += static_cast<long>(image.total());
  return true;
}

std::shared_ptr<const ImagePyramid> ImageStore::Read(const Entry& entry) {
  GreyImage image(entry.size);
  if (std::fseek(file_, entry.at, SEEK_SET) != 0 ||
      std::fread(image.data, 1, image.total(), file_) != image.total())
    throw Error("a temporary file of images cannot be read back: {}", std::strerror(errno));
  return std::make_shared<const ImagePyramid>(image, entry.levels);
}

}  // namespace deepuav
