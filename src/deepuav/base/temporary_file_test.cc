#include "deepuav/base/temporary_file.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <string>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

std::array<std::byte, 3> Three(int first) {
  return {static_cast<std::byte>(first), static_cast<std::byte>(first + 1),
          static_cast<std::byte>(first + 2)};
}

TEST(TemporaryFile, GivesBackWhatWasAppended) {
  TemporaryFile file;
  const auto first = file.Append(Three(1));
  const auto second = file.Append(Three(7));
  ASSERT_TRUE(first && second);
  std::array<std::byte, 3> read{};
  file.Read(*second, read);
  EXPECT_EQ(read, Three(7));
  file.Read(*first, read);
  EXPECT_EQ(read, Three(1));
  const auto third = file.Append(Three(20));
  ASSERT_TRUE(third);
  file.Read(*third, read);
  EXPECT_EQ(read, Three(20));
}

TEST(TemporaryFile, NothingCanBeAppendedAndReadBack) {
  TemporaryFile file;
  EXPECT_EQ(file.Append({}), 0);
  EXPECT_EQ(file.Append(Three(1)), 0);
  EXPECT_EQ(file.Append({}), 3);
  file.Read(3, {});
}

TEST(TemporaryFile, PastTheEndIsAnError) {
  TemporaryFile file;
  std::array<std::byte, 3> read{};
  EXPECT_THROW(file.Read(0, read), Error);
  ASSERT_TRUE(file.Append(Three(1)));
  EXPECT_THROW(file.Read(1, read), Error);
}

TEST(TemporaryFile, WithoutAFolderNothingIsAppended) {
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  setenv("TMPDIR", "/nowhere/at/all", 1);
  TemporaryFile file;
  EXPECT_FALSE(file.Append(Three(1)));
  before ? setenv("TMPDIR", kept.c_str(), 1) : unsetenv("TMPDIR");
}

}  // namespace
}  // namespace deepuav
