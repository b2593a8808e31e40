#include "deepuav/inference/blob_cache.h"

#include <gtest/gtest.h>

#include <fstream>

namespace deepuav {
namespace {

class BlobCacheTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("blob_cache_") +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::vector<std::filesystem::path> Entries() const {
    std::vector<std::filesystem::path> entries;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      entries.push_back(entry.path());
    return entries;
  }

  std::filesystem::path folder_;
};

TEST_F(BlobCacheTest, GivesBackWhatWasStored) {
  const BlobCache cache(folder_ / "deep");
  const std::string bytes("a\0\n\xff", 4);
  EXPECT_FALSE(cache.Load("key"));
  cache.Store("key", bytes);
  cache.Store("empty", "");
  EXPECT_EQ(cache.Load("key"), bytes);
  EXPECT_EQ(cache.Load("empty"), "");
  EXPECT_FALSE(cache.Load("other key"));
  cache.Store("key", "newer");
  EXPECT_EQ(cache.Load("key"), "newer");
}

TEST_F(BlobCacheTest, LeavesNoTemporaryFiles) {
  const BlobCache cache(folder_);
  cache.Store("key", "bytes");
  ASSERT_EQ(Entries().size(), 1u);
  EXPECT_EQ(Entries()[0].extension(), ".blob");
}

TEST_F(BlobCacheTest, RemovesWhatWasNotUsedForTheLongestTime) {
  namespace fs = std::filesystem;
  const BlobCache cache(folder_, 1000);
  const std::string bytes(300, 'x');  // and 64 of digest
  const auto an_hour_ago = fs::file_time_type::clock::now() - std::chrono::hours(2);
  for (const char* key : {"a", "b"}) {
    cache.Store(key, bytes);
    for (const fs::path& entry : Entries()) fs::last_write_time(entry, an_hour_ago);
  }
  EXPECT_TRUE(cache.Load("a"));
  std::ofstream(folder_ / "left.1-2.tmp") << "of a process that was killed";
  fs::last_write_time(folder_ / "left.1-2.tmp", an_hour_ago);
  std::ofstream(folder_ / "written.1-3.tmp") << "by another process";
  cache.Store("c", bytes);
  EXPECT_TRUE(cache.Load("a"));
  EXPECT_FALSE(cache.Load("b"));
  EXPECT_TRUE(cache.Load("c"));
  EXPECT_FALSE(fs::exists(folder_ / "left.1-2.tmp"));
  EXPECT_TRUE(fs::exists(folder_ / "written.1-3.tmp"));
}

TEST_F(BlobCacheTest, DamagedEntriesAreNotUsed) {
  const BlobCache cache(folder_);
  cache.Store("key", "some bytes");
  const auto entry = Entries().at(0);
  const auto size = std::filesystem::file_size(entry);
  std::filesystem::resize_file(entry, size - 1);
  EXPECT_FALSE(cache.Load("key"));
  std::filesystem::resize_file(entry, 10);
  EXPECT_FALSE(cache.Load("key"));
  cache.Store("key", "some bytes");
  std::fstream(entry, std::ios::in | std::ios::out | std::ios::binary)
      .seekp(-1, std::ios::end)
      .put('X');
  EXPECT_FALSE(cache.Load("key"));
}

TEST_F(BlobCacheTest, WithoutFolderKeepsNothing) {
  const BlobCache cache("");
  cache.Store("key", "bytes");
  EXPECT_FALSE(cache.Load("key"));
}

TEST_F(BlobCacheTest, UnwritableFolderIsNoError) {
  std::ofstream(folder_) << "a file where the folder should be";
  const BlobCache cache(folder_ / "inside");
  EXPECT_NO_THROW(cache.Store("key", "bytes"));
  EXPECT_FALSE(cache.Load("key"));
}

}  // namespace
}  // namespace deepuav
