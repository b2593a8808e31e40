#include "deepuav/io/files/temporary_files.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr size_t kSlots = 64;

// Null where free. Filled under the mutex; a signal handler, which cannot wait, only takes out.
std::array<std::atomic<char*>, kSlots> slots;
// What the handler took out of each: freed where it is filled again, since a handler cannot free.
std::array<std::atomic<char*>, kSlots> removed;
std::mutex mutex;
static_assert(std::atomic<char*>::is_always_lock_free);

// The working folder may be another when the program ends.
std::string AbsoluteName(const fs::path& file) {
  std::error_code error;
  const fs::path absolute = fs::absolute(file, error);
  return error ? file.string() : absolute.string();
}

}  // namespace

void RememberTemporaryFile(const fs::path& file) {
  const std::string name = AbsoluteName(file);
  const std::lock_guard lock(mutex);
  for (size_t i = 0; i < kSlots; ++i) {
    if (slots[i]) continue;
    std::free(removed[i].exchange(nullptr));
    slots[i] = ::strdup(name.c_str());
    return;
  }
}

void ForgetTemporaryFile(const fs::path& file) {
  const std::string wanted = AbsoluteName(file);
  const std::lock_guard lock(mutex);
  for (std::atomic<char*>& slot : slots) {
    char* name = slot;
    if (!name || wanted != name) continue;
    if (slot.compare_exchange_strong(name, nullptr)) std::free(name);
    return;
  }
}

void RemoveTemporaryFiles() noexcept {
  for (size_t i = 0; i < kSlots; ++i) {
    char* name = slots[i].exchange(nullptr);
    if (!name) continue;
    ::unlink(name);
    removed[i] = name;
  }
}

}  // namespace deepuav
