#include "deepuav/base/sha256.h"

#include <gtest/gtest.h>

#include <fstream>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

// Examples of FIPS 180-2, appendix B.
TEST(Sha256, KnownVectors) {
  EXPECT_EQ(Sha256(std::string()),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Sha256(std::string("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256(std::string("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq")),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(Sha256(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, FilesAreHashedOneAfterTheOther) {
  const std::filesystem::path folder = testing::TempDir();
  std::ofstream(folder / "sha256_first") << std::string(700000, 'a');
  std::ofstream(folder / "sha256_second") << std::string(300000, 'a');
  EXPECT_EQ(Sha256OfFiles({folder / "sha256_first", folder / "sha256_second"}),
            Sha256(std::string(1000000, 'a')));
}

TEST(Sha256, UnreadableFileIsNamed) {
  try {
    Sha256OfFiles({"no/such/file"});
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("no/such/file"), std::string::npos);
  }
}

}  // namespace
}  // namespace deepuav
