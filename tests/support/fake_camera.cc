// A camera as Linux shows one (V4L2, streaming, Motion JPEG), for machines that have none: loaded
// before the program (LD_PRELOAD), it stands for $FAKE_CAMERA_DEVICE. Its images are 000.jpg,
// 001.jpg, ... of $FAKE_CAMERA_IMAGES, all of $FAKE_CAMERA_SIZE ("320x240"), $FAKE_CAMERA_HZ a
// second, again and again. While a file "gone" lies beside them, it is unplugged; while one
// "stalled" does, it gives none.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <fstream>
#include <string>

namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;
constexpr unsigned kMostBuffers = 4;

struct Camera {
  int handle = -1;  // A timer's, which becomes readable whenever an image is due.
  unsigned taken = 0;
  std::deque<unsigned> queued;
  std::array<void*, kMostBuffers> buffers{};
};
Camera camera;

std::string Setting(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::string FileOf(const std::string& name) { return Setting("FAKE_CAMERA_IMAGES") + "/" + name; }

bool IsGone() { return ::access(FileOf("gone").c_str(), F_OK) == 0; }

bool IsCamera(const char* path) { return path && *path && Setting("FAKE_CAMERA_DEVICE") == path; }

double Rate() { return std::atof(Setting("FAKE_CAMERA_HZ").c_str()); }

int Fail(int error) {
  errno = error;
  return -1;
}

int OpenCamera() {
  if (IsGone()) return Fail(ENODEV);
  if (camera.handle >= 0) return Fail(EBUSY);
  camera.handle = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
  camera.queued.clear();
  return camera.handle;
}

bool IsStalled() { return ::access(FileOf("stalled").c_str(), F_OK) == 0; }

int Start(bool runs) {
  itimerspec every{};
  if (runs && !IsStalled())
    every.it_interval.tv_nsec = every.it_value.tv_nsec = static_cast<long>(1e9 / Rate());
  if (!runs) camera.queued.clear();
  return ::timerfd_settime(camera.handle, 0, &every, nullptr);
}

int Describe(v4l2_capability* told) {
  *told = {};
  std::snprintf(reinterpret_cast<char*>(told->driver), sizeof told->driver, "fake");
  std::snprintf(reinterpret_cast<char*>(told->card), sizeof told->card, "fake camera");
  told->capabilities = told->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  told->capabilities |= V4L2_CAP_DEVICE_CAPS;
  return 0;
}

// It has one format, and answers with that whatever is asked for.
int Format(v4l2_format* format) {
  if (format->type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return Fail(EINVAL);
  v4l2_pix_format& pixels = format->fmt.pix;
  if (std::sscanf(Setting("FAKE_CAMERA_SIZE").c_str(), "%ux%u", &pixels.width, &pixels.height) != 2)
    return Fail(EINVAL);
  pixels.pixelformat = V4L2_PIX_FMT_MJPEG;
  pixels.field = V4L2_FIELD_NONE;
  pixels.bytesperline = 0;
  pixels.sizeimage = kBufferBytes;
  pixels.colorspace = V4L2_COLORSPACE_JPEG;
  return 0;
}

int Interval(v4l2_streamparm* told) {
  v4l2_captureparm& capture = told->parm.capture;
  capture.capability = V4L2_CAP_TIMEPERFRAME;
  capture.timeperframe = {1, static_cast<unsigned>(Rate())};
  return 0;
}

int Buffer(v4l2_buffer* buffer) {
  if (buffer->index >= kMostBuffers) return Fail(EINVAL);
  buffer->length = kBufferBytes;
  buffer->m.offset = static_cast<unsigned>(buffer->index * kBufferBytes);
  buffer->flags = V4L2_BUF_FLAG_MAPPED | V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  return 0;
}

unsigned Copy(void* target) {
  std::array<char, 16> name{};
  std::snprintf(name.data(), name.size(), "%03u.jpg", camera.taken);
  std::ifstream file(FileOf(name.data()), std::ios::binary);
  if (!file && camera.taken > 0) {
    camera.taken = 0;
    return Copy(target);
  }
  file.read(static_cast<char*>(target), kBufferBytes);
  return static_cast<unsigned>(file.gcount());
}

int Take(v4l2_buffer* buffer) {
  if (IsGone()) return Fail(ENODEV);
  uint64_t due = 0;
  if (camera.queued.empty() || ::read(camera.handle, &due, sizeof due) != sizeof due)
    return Fail(EAGAIN);
  buffer->index = camera.queued.front();
  camera.queued.pop_front();
  Buffer(buffer);
  buffer->bytesused = Copy(camera.buffers[buffer->index]);
  ++camera.taken;
  if (IsStalled()) Start(true);
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  buffer->timestamp = {now.tv_sec, now.tv_nsec / 1000};
  buffer->sequence = camera.taken;
  return 0;
}

int Answer(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      return Describe(static_cast<v4l2_capability*>(argument));
    case VIDIOC_G_INPUT:
    case VIDIOC_S_INPUT:
      *static_cast<int*>(argument) = 0;
      return 0;
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT:
    case VIDIOC_TRY_FMT:
      return Format(static_cast<v4l2_format*>(argument));
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
      return Interval(static_cast<v4l2_streamparm*>(argument));
    case VIDIOC_REQBUFS: {
      auto* wanted = static_cast<v4l2_requestbuffers*>(argument);
      wanted->count = std::min(wanted->count, kMostBuffers);
      return 0;
    }
    case VIDIOC_QUERYBUF:
      return Buffer(static_cast<v4l2_buffer*>(argument));
    case VIDIOC_QBUF:
      if (IsGone()) return Fail(ENODEV);
      camera.queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
      return 0;
    case VIDIOC_DQBUF:
      return Take(static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      return Start(true);
    case VIDIOC_STREAMOFF:
      return Start(false);
    default:
      return Fail(EINVAL);
  }
}

template <typename Function>
Function Real(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

int Open(const char* symbol, const char* path, int flags, va_list rest) {
  if (IsCamera(path)) return OpenCamera();
  const bool makes = (flags & (O_CREAT | O_TMPFILE)) != 0;
  const mode_t mode = makes ? va_arg(rest, mode_t) : 0;
  return Real<int (*)(const char*, int, ...)>(symbol)(path, flags, mode);
}

void* Map(const char* symbol, void* address, size_t length, int protection, int flags, int handle,
          off_t offset) {
  if (handle < 0 || handle != camera.handle)
    return Real<void* (*)(void*, size_t, int, int, int, off_t)>(symbol)(address, length, protection,
                                                                        flags, handle, offset);
  void* memory = Real<void* (*)(void*, size_t, int, int, int, off_t)>(symbol)(
      nullptr, length, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  camera.buffers[static_cast<size_t>(offset) / kBufferBytes] = memory;
  return memory;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int handle = Open("open", path, flags, rest);
  va_end(rest);
  return handle;
}

int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int handle = Open("open64", path, flags, rest);
  va_end(rest);
  return handle;
}

int close(int handle) {
  if (handle >= 0 && handle == camera.handle) camera.handle = -1;
  return Real<int (*)(int)>("close")(handle);
}

int ioctl(int handle, unsigned long request, ...) noexcept {
  va_list rest;
  va_start(rest, request);
  void* argument = va_arg(rest, void*);
  va_end(rest);
  if (handle >= 0 && handle == camera.handle) return Answer(request, argument);
  return Real<int (*)(int, unsigned long, void*)>("ioctl")(handle, request, argument);
}

void* mmap(void* address, size_t length, int protection, int flags, int handle,
           off_t offset) noexcept {
  return Map("mmap", address, length, protection, flags, handle, offset);
}

void* mmap64(void* address, size_t length, int protection, int flags, int handle,
             off64_t offset) noexcept {
  return Map("mmap64", address, length, protection, flags, handle, offset);
}

}  // extern "C"
