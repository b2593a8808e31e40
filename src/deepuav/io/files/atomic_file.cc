#include "deepuav/io/files/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "deepuav/base/error.h"
#include "deepuav/io/files/temporary_files.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr size_t kBufferBytes = size_t{1} << 20;
constexpr int kMode = 0666;  // less the umask

// Short whatever the file is called, and of no other writer.
std::string TemporaryName() {
  static std::atomic<unsigned> count{0};
  return fmt::format(".deepuav-{}-{}.tmp", ::getpid(), count.fetch_add(1));
}

// The renaming itself must reach the disk; a file system that cannot do this has done what it can.
void SyncFolder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

fs::path FolderOf(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& file) : file_(file), target_(file) {
  std::error_code error;
  if (fs::is_symlink(file, error)) {
    target_ = fs::weakly_canonical(file, error);
    if (error) throw Error("{}: cannot be written: {}", file_.string(), error.message());
  }
  const fs::file_status status = fs::status(target_, error);
  if (fs::is_directory(status))
    throw Error("{}: cannot be written: it is a folder", file_.string());
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    descriptor_ = ::open(target_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    temporary_ = FolderOf(target_) / TemporaryName();
    RememberTemporaryFile(temporary_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
  }
  if (descriptor_ < 0) {
    const int reason = errno;
    ForgetTemporaryFile(temporary_);
    throw Error("{}: cannot be created: {}", file_.string(), std::strerror(reason));
  }
}

AtomicFile::~AtomicFile() { Discard(); }

void AtomicFile::Discard() noexcept {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  descriptor_ = -1;
  if (temporary_.empty()) return;
  ::unlink(temporary_.c_str());
  ForgetTemporaryFile(temporary_);
}

void AtomicFile::Fail(const char* what) {
  const int reason = errno;
  Discard();
  throw Error("{}: {}: {}", file_.string(), what, std::strerror(reason));
}

void AtomicFile::Write(std::string_view bytes) {
  buffer_.append(bytes);
  if (buffer_.size() >= kBufferBytes) Flush();
}

void AtomicFile::Flush() {
  for (std::string_view rest = buffer_; !rest.empty();) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) Fail("cannot be written");
    rest.remove_prefix(static_cast<size_t>(written));
  }
  buffer_.clear();
}

void AtomicFile::Commit() {
  Flush();
  if (temporary_.empty()) {
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (::close(descriptor) != 0) Fail("cannot be written");
    return;
  }
  if (::fsync(descriptor_) != 0) Fail("cannot be flushed to the disk");
  const int descriptor = descriptor_;
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) Fail("cannot be renamed into place");
  descriptor_ = -1;
  ForgetTemporaryFile(temporary_);
  ::close(descriptor);
  SyncFolder(FolderOf(target_));
}

void WriteFileAtomically(const fs::path& file, std::string_view bytes) {
  AtomicFile atomic(file);
  atomic.Write(bytes);
  atomic.Commit();
}

}  // namespace deepuav
