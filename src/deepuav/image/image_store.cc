#include "deepuav/image/image_store.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>

#include "deepuav/base/logging.h"

namespace deepuav {

ImageStore::ImageStore(int most_in_memory)
    : most_in_memory_(static_cast<size_t>(std::max(1, most_in_memory))) {}

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
  const GreyImage image = entry->image->image();
  const GreyImage together = image.isContinuous() ? image : GreyImage(image.clone());
  const auto at = file_.Append(std::as_bytes(std::span(together.data, together.total())));
  if (at) entry->at = *at;
  return at.has_value();
}

std::shared_ptr<const ImagePyramid> ImageStore::Read(const Entry& entry) {
  GreyImage image(entry.size);
  file_.Read(entry.at, std::as_writable_bytes(std::span(image.data, image.total())));
  return std::make_shared<const ImagePyramid>(image, entry.levels);
}

}  // namespace deepuav
