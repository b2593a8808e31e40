#include "deepuav/io/files/folder_lock.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class FolderLockTest : public ::testing::Test {
 protected:
  FolderLockTest()
      : folder_(fs::temp_directory_path() / ("deepuav-lock-test-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~FolderLockTest() override { fs::remove_all(folder_); }

  fs::path folder_;
};

TEST_F(FolderLockTest, IsHeldByOneAtATimeAndLeavesNothing) {
  {
    const FolderLock lock(folder_);
    EXPECT_THAT([&] { FolderLock second(folder_); },
                ThrowsMessage<Error>(HasSubstr("another deepuav is writing into it")));
  }
  EXPECT_NO_THROW(FolderLock again(folder_));
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(FolderLockTest, OfTwoFoldersAreTwo) {
  fs::create_directories(folder_ / "inner");
  const FolderLock lock(folder_);
  EXPECT_NO_THROW(FolderLock inner(folder_ / "inner"));
}

TEST_F(FolderLockTest, NeedsAFolder) {
  EXPECT_THAT([&] { FolderLock lock(folder_ / "absent"); },
              ThrowsMessage<Error>(HasSubstr("absent: cannot be opened")));
}

}  // namespace
}  // namespace deepuav
