#include "deepuav/io/files/temporary_files.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "deepuav/io/files/atomic_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

class TemporaryFilesTest : public ::testing::Test {
 protected:
  TemporaryFilesTest()
      : folder_(fs::temp_directory_path() / ("deepuav-temporary-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~TemporaryFilesTest() override { fs::remove_all(folder_); }

  fs::path Make(const std::string& name) const {
    std::ofstream(folder_ / name) << "half";
    return folder_ / name;
  }

  fs::path folder_;
};

TEST_F(TemporaryFilesTest, RemovesWhatIsRemembered) {
  const fs::path lives = Make("lives"), lived = Make("lived");
  RememberTemporaryFile(lives);
  RememberTemporaryFile(lived);
  ForgetTemporaryFile(lived);
  RemoveTemporaryFiles();
  EXPECT_FALSE(fs::exists(lives));
  EXPECT_TRUE(fs::exists(lived));
}

TEST_F(TemporaryFilesTest, MoreThanTheTableHoldsDoNoHarm) {
  for (int i = 0; i < 200; ++i) RememberTemporaryFile(folder_ / std::to_string(i));
  for (int i = 0; i < 200; ++i) ForgetTemporaryFile(folder_ / std::to_string(i));
  const fs::path next = Make("next");
  RememberTemporaryFile(next);
  RemoveTemporaryFiles();
  EXPECT_FALSE(fs::exists(next));
}

TEST_F(TemporaryFilesTest, ASignalLeavesNothingOfAnAtomicFile) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    std::signal(SIGTERM, [](int signal) {
      RemoveTemporaryFiles();
      std::signal(signal, SIG_DFL);
      std::raise(signal);
    });
    AtomicFile file(folder_ / "result");
    file.Write("half of it");
    std::raise(SIGTERM);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace deepuav
