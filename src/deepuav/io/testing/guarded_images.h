#pragma once

#include <algorithm>
#include <opencv2/core.hpp>

namespace deepuav {

/// While it lives, images are followed by bytes that nobody may write to. A sanitizer does not see
/// what FFmpeg writes.
class GuardedImages : private cv::MatAllocator {
 public:
  GuardedImages() : before_(cv::Mat::getDefaultAllocator()) { cv::Mat::setDefaultAllocator(this); }
  ~GuardedImages() override { cv::Mat::setDefaultAllocator(before_); }
  GuardedImages(const GuardedImages&) = delete;
  GuardedImages& operator=(const GuardedImages&) = delete;

  /// Of the images that are gone.
  int overrun() const { return overrun_; }

 private:
  static constexpr size_t kGuardBytes = 64;
  static constexpr uchar kGuard = 0xa5;

  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, size_t* step,
                         cv::AccessFlag, cv::UMatUsageFlags) const override {
    size_t bytes = CV_ELEM_SIZE(type);
    for (int i = dims - 1; i >= 0; --i) {
      if (step) {
        if (data && step[i] != cv::Mat::AUTO_STEP) {
          bytes = step[i];
        } else {
          step[i] = bytes;
        }
      }
      bytes *= static_cast<size_t>(sizes[i]);
    }
    auto* image = new cv::UMatData(this);
    image->size = bytes;
    if (data) {
      image->data = image->origdata = static_cast<uchar*>(data);
      image->flags |= cv::UMatData::USER_ALLOCATED;
    } else {
      image->data = image->origdata = static_cast<uchar*>(cv::fastMalloc(bytes + kGuardBytes));
      std::fill_n(image->data + bytes, kGuardBytes, kGuard);
    }
    return image;
  }
  bool allocate(cv::UMatData* image, cv::AccessFlag, cv::UMatUsageFlags) const override {
    return image != nullptr;
  }
  void deallocate(cv::UMatData* image) const override {
    if (!image) return;
    if (!(image->flags & cv::UMatData::USER_ALLOCATED)) {
      const uchar* guard = image->origdata + image->size;
      if (std::count(guard, guard + kGuardBytes, kGuard) != kGuardBytes) ++overrun_;
      cv::fastFree(image->origdata);
    }
    delete image;
  }

  cv::MatAllocator* const before_;
  mutable int overrun_ = 0;
};

}  // namespace deepuav
