#include "deepuav/io/files/atomic_file.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

size_t FilesIn(const fs::path& folder) {
  return static_cast<size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(AtomicFile, AppearsOnlyWhenCommitted) {
  const TemporaryFolder folder;
  const fs::path file = folder.Write("map.txt", "old");
  {
    AtomicFile output(file);
    output.Write("new ");
    output.Write(std::string(3 << 20, 'x'));
    EXPECT_EQ(ReadAll(file), "old");
    output.Commit();
  }
  EXPECT_EQ(ReadAll(file), "new " + std::string(3 << 20, 'x'));
  EXPECT_EQ(FilesIn(folder.path()), 1u);
}

TEST(AtomicFile, LeavesNothingWithoutCommit) {
  const TemporaryFolder folder;
  const fs::path file = folder.Write("map.txt", "old");
  {
    AtomicFile output(file);
    output.Write(std::string(3 << 20, 'x'));
    EXPECT_EQ(FilesIn(folder.path()), 2u);
  }
  EXPECT_EQ(ReadAll(file), "old");
  EXPECT_EQ(FilesIn(folder.path()), 1u);
}

TEST(AtomicFile, HasThePermissionsOfAnyNewFile) {
  const TemporaryFolder folder;
  const mode_t mask = ::umask(022);
  WriteFileAtomically(folder.path() / "a", "text");
  ::umask(mask);
  struct stat status {};
  ASSERT_EQ(::stat((folder.path() / "a").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0644u);
}

TEST(AtomicFile, WritesBehindASymbolicLink) {
  const TemporaryFolder folder;
  const fs::path file = folder.Write("real/file", "old");
  fs::create_symlink(file, folder.path() / "link");
  WriteFileAtomically(folder.path() / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
  EXPECT_EQ(ReadAll(file), "new");
}

TEST(AtomicFile, TakesAVeryLongName) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / std::string(255, 'n');
  WriteFileAtomically(file, "text");
  EXPECT_EQ(ReadAll(file), "text");
}

TEST(AtomicFile, AFullDiskIsAnErrorAndKeepsTheDevice) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  EXPECT_EQ(ErrorOf([] { WriteFileAtomically("/dev/full", "text"); }),
            "/dev/full: cannot be written: No space left on device");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

// The limit on a file's size stands for a disk that fills up while a regular file is written.
TEST(AtomicFile, ADiskThatFillsUpLeavesTheOldFile) {
  const TemporaryFolder folder;
  const fs::path file = folder.Write("map.txt", "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{1 << 16, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
  const std::string message =
      ErrorOf([&] { WriteFileAtomically(file, std::string(1 << 22, 'x')); });
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(message, file.string() + ": cannot be written: File too large");
  EXPECT_EQ(ReadAll(file), "old");
  EXPECT_EQ(FilesIn(folder.path()), 1u);
}

TEST(AtomicFile, ErrorsNameTheFileAndTheReason) {
  const TemporaryFolder folder;
  const std::string lost = (folder.path() / "no/such/folder.txt").string();
  EXPECT_EQ(ErrorOf([&] { WriteFileAtomically(lost, ""); }),
            lost + ": cannot be created: No such file or directory");
  EXPECT_EQ(ErrorOf([&] { WriteFileAtomically(folder.path(), ""); }),
            folder.path().string() + ": cannot be written: it is a folder");
  const std::string below_file = (folder.Write("plain", "") / "x").string();
  EXPECT_EQ(ErrorOf([&] { WriteFileAtomically(below_file, ""); }),
            below_file + ": cannot be created: Not a directory");
}

TEST(AtomicFile, AnUnwritableFolderIsAnError) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec);
  const std::string file = (folder.path() / "a").string();
  const std::string message = ErrorOf([&] { WriteFileAtomically(file, ""); });
  fs::permissions(folder.path(), fs::perms::owner_all);
  EXPECT_EQ(message, file + ": cannot be created: Permission denied");
}

}  // namespace
}  // namespace deepuav
