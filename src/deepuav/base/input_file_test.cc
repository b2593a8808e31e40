#include "deepuav/base/input_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class InputFileTest : public ::testing::Test {
 protected:
  InputFileTest()
      : folder_(fs::temp_directory_path() / ("deepuav-input-test-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~InputFileTest() override { fs::remove_all(folder_); }

  fs::path folder_;
};

TEST_F(InputFileTest, RefusesANamedPipeUnderAnyName) {
  const fs::path pipe = folder_ / "pipe", link = folder_ / "link.txt";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  fs::create_symlink(pipe, link);
  for (const fs::path& file : {pipe, link}) {
    EXPECT_THAT([&] { RefuseNamedPipe(file); },
                ThrowsMessage<Error>(HasSubstr(file.string() + ": is a named pipe")));
  }
}

TEST_F(InputFileTest, LetsAllElsePass) {
  const fs::path file = folder_ / "file";
  std::ofstream(file) << "text";
  for (const fs::path& passes : {file, folder_, folder_ / "absent", fs::path("/dev/null")})
    EXPECT_NO_THROW(RefuseNamedPipe(passes)) << passes;
}

TEST_F(InputFileTest, LetsThePipesOfAShellPass) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  EXPECT_NO_THROW(RefuseNamedPipe("/dev/fd/" + std::to_string(ends[0])));
  ::close(ends[0]);
  ::close(ends[1]);
}

}  // namespace
}  // namespace deepuav
