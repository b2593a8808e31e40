#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"
#include "deepuav/base/sha256.h"
#include "deepuav/place/vocabulary.h"

namespace deepuav {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr size_t kMagicBytes = 8, kDigestBytes = 64;

/// Ten nodes of three words each.
Vocabulary SomeVocabulary() {
  constexpr int kDimension = 16, kBranches = 10, kWordsEach = 3;
  Random random(1);
  VocabularyTree tree;
  tree.dimension = kDimension;
  tree.child_counts.assign(1, kBranches);
  tree.child_counts.resize(1 + kBranches, kWordsEach);
  tree.child_counts.resize(1 + kBranches + kBranches * kWordsEach, 0);
  for (size_t i = 0; i < (tree.child_counts.size() - 1) * kDimension; ++i)
    tree.centres.push_back(static_cast<int8_t>(random.Index(255) - 127));
  for (int i = 0; i < kBranches * kWordsEach; ++i)
    tree.idf.push_back(static_cast<float>(random.Uniform(0, 7)));
  return Vocabulary(tree);
}

/// The message with which bytes are refused; empty if they are not.
std::string Refusal(const std::string& bytes) {
  try {
    Vocabulary::FromBytes(bytes, "words.bin");
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

/// With the digest that belongs to the damaged content, as only a broken program writes it.
std::string Sign(std::string bytes) {
  bytes.resize(bytes.size() - kDigestBytes);
  return bytes + Sha256(bytes);
}

TEST(VocabularyFile, RoundTripIsEqualToTheByte) {
  const Vocabulary original = SomeVocabulary();
  const Vocabulary read = Vocabulary::FromBytes(original.Bytes(), "words.bin");
  EXPECT_EQ(read.Bytes(), original.Bytes());
  EXPECT_EQ(read.sha256(), original.sha256());
  EXPECT_EQ(read.tree().centres, original.tree().centres);
  EXPECT_EQ(read.tree().idf, original.tree().idf);
  EXPECT_EQ(read.tree().child_counts, original.tree().child_counts);
}

TEST(VocabularyFile, LoadReadsAFileAndNamesOneThatItCannotRead) {
  const auto file = std::filesystem::path(testing::TempDir()) / "deepuav_vocabulary_test.bin";
  std::ofstream(file, std::ios::binary) << SomeVocabulary().Bytes();
  EXPECT_EQ(Vocabulary::Load(file).sha256(), SomeVocabulary().sha256());
  std::filesystem::remove(file);
  for (const auto& missing : {file, std::filesystem::path(testing::TempDir())}) {
    try {
      Vocabulary::Load(missing);
      ADD_FAILURE() << missing << " was read";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(missing.string()));
    }
  }
}

TEST(VocabularyFile, SaysWhatIsWrong) {
  const std::string bytes = SomeVocabulary().Bytes();
  EXPECT_THAT(Refusal("PK\x03\x04 something else altogether"),
              AllOf(HasSubstr("words.bin"), HasSubstr("no vocabulary")));
  std::string newer = bytes;
  newer[kMagicBytes] = 2;
  EXPECT_THAT(Refusal(newer), HasSubstr("version 2: expected 1"));
  std::string flipped = bytes;
  flipped[bytes.size() / 2] ^= 1;
  EXPECT_THAT(Refusal(flipped), HasSubstr("damaged"));
  EXPECT_THAT(Refusal(bytes + "x"), HasSubstr("expected"));
}

TEST(VocabularyFile, EveryTruncationIsRefused) {
  const std::string bytes = SomeVocabulary().Bytes();
  for (size_t length = 0; length < bytes.size(); ++length)
    ASSERT_NE(Refusal(bytes.substr(0, length)), "") << length;
}

TEST(VocabularyFile, EveryFlippedBitIsRefused) {
  std::string bytes = SomeVocabulary().Bytes();
  for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const auto mask = static_cast<char>(1 << (bit % 8));
    bytes[bit / 8] ^= mask;
    ASSERT_NE(Refusal(bytes), "") << bit;
    bytes[bit / 8] ^= mask;
  }
}

/// Overwrites, cuts and inserts.
std::string Damage(std::string bytes, Random* random) {
  const auto position = [&] {
    return static_cast<size_t>(random->Index(static_cast<int>(bytes.size())));
  };
  constexpr int kMaxStretch = 40, kHeaderBytes = 24;
  for (int left = 1 + random->Index(3); left > 0 && !bytes.empty(); --left) {
    const size_t at = random->Index(2) == 0 ? position() : position() % kHeaderBytes;
    switch (random->Index(4)) {
      case 0:
        bytes[at % bytes.size()] = static_cast<char>(random->Index(256));
        break;
      case 1: {
        constexpr uint32_t kNumbers[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0xffff};
        const uint32_t number = kNumbers[random->Index(6)];
        if (at + sizeof number <= bytes.size())
          std::memcpy(bytes.data() + at, &number, sizeof number);
        break;
      }
      case 2:
        bytes.erase(at % bytes.size(), static_cast<size_t>(random->Index(kMaxStretch)));
        break;
      default:
        bytes.insert(at % bytes.size(), static_cast<size_t>(random->Index(kMaxStretch)), '\x7f');
    }
  }
  return bytes;
}

TEST(VocabularyFile, AnyDamageIsRefused) {
  const std::string bytes = SomeVocabulary().Bytes();
  Random random(2);
  for (int i = 0; i < 5000; ++i) {
    const std::string damaged = Damage(bytes, &random);
    if (damaged != bytes) {
      ASSERT_NE(Refusal(damaged), "") << i;
    }
  }
}

TEST(VocabularyFile, DamageUnderAFittingDigestIsRefusedOrAVocabularyThatWorks) {
  const std::string bytes = SomeVocabulary().Bytes();
  Random random(3);
  int refused = 0, read = 0;
  for (int i = 0; i < 5000; ++i) {
    std::string damaged = Damage(bytes, &random);
    if (damaged.size() < kDigestBytes) continue;
    damaged = Sign(std::move(damaged));
    try {
      const Vocabulary vocabulary = Vocabulary::FromBytes(damaged, "words.bin");
      ++read;
      EXPECT_EQ(vocabulary.Bytes(), damaged);
      Descriptors descriptors(vocabulary.dimension());
      descriptors.Append(std::vector<float>(static_cast<size_t>(vocabulary.dimension()), 0.1f));
      EXPECT_LT(vocabulary.WordIndices(descriptors).front(), vocabulary.word_count());
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
  EXPECT_GT(read, 100);
}

}  // namespace
}  // namespace deepuav
