#include "deepuav/io/files/text_file.h"

#include <limits>

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

TEST(ParseSeconds, IsExact) {
  const auto nanoseconds = [](std::string_view text) {
    return ParseSeconds(text, "t").nanoseconds;
  };
  EXPECT_EQ(nanoseconds("1403636584.763555584"), 1403636584763555584);
  EXPECT_EQ(nanoseconds("1.403636584763555584e+09"), 1403636584763555584);
  EXPECT_EQ(nanoseconds("1403636584763555584E-9"), 1403636584763555584);
  EXPECT_EQ(nanoseconds("0"), 0);
  EXPECT_EQ(nanoseconds("0.000000e+00"), 0);
  EXPECT_EQ(nanoseconds("-0.25"), -250000000);
  EXPECT_EQ(nanoseconds("+.5"), 500000000);
  EXPECT_EQ(nanoseconds("5."), 5000000000);
  EXPECT_EQ(nanoseconds("0000000000000000000000000001.5"), 1500000000);
  EXPECT_EQ(nanoseconds("9223372036.854775807"), std::numeric_limits<int64_t>::max());
}

TEST(ParseSeconds, RoundsToTheNanosecond) {
  EXPECT_EQ(ParseSeconds("1.0000000004", "t").nanoseconds, 1000000000);
  EXPECT_EQ(ParseSeconds("1.0000000005", "t").nanoseconds, 1000000001);
  EXPECT_EQ(ParseSeconds("0.0000000005", "t").nanoseconds, 1);
  EXPECT_EQ(ParseSeconds("1e-300", "t").nanoseconds, 0);
}

TEST(ParseSeconds, RefusesWhatIsNoTimeOrTooLarge) {
  for (const char* text : {"", ".", "-", "1.2.3", "nan", "inf", "1e", "1e999999999999", "0x10",
                           "1 2", "9223372036.854775808", "1403636584763555584", "1e30"}) {
    const std::string message = ErrorOf([&] { ParseSeconds(text, "f.txt:3"); });
    EXPECT_TRUE(message.starts_with("f.txt:3: time is '" + std::string(text) + "'")) << message;
  }
}

TEST(ParseNanoseconds, IsExact) {
  EXPECT_EQ(ParseNanoseconds("1403636584763555584", "t").nanoseconds, 1403636584763555584);
  EXPECT_EQ(ParseNanoseconds("1.403636584763555584e18", "t").nanoseconds, 1403636584763555584);
}

TEST(ParseFinite, AcceptsNumbersAndNothingElse) {
  EXPECT_EQ(ParseFinite("1.5e-3", "t", "fx"), 1.5e-3);
  EXPECT_EQ(ParseFinite("+2", "t", "fx"), 2);
  for (const char* text : {"nan", "inf", "-inf", "1e999", "", "12px", "--1"}) {
    EXPECT_EQ(ErrorOf([&] { ParseFinite(text, "f:1", "fx"); }),
              "f:1: fx is '" + std::string(text) + "': expected a finite number");
  }
}

TEST(TextFile, LeavesOutCommentsAndBlanks) {
  const TemporaryFolder folder;
  const TextFile file(folder.Write("a.txt", "\xEF\xBB\xBF# head\r\n\r\n  first line \r\n#x\nlast"));
  ASSERT_EQ(file.lines().size(), 2u);
  EXPECT_EQ(file.lines()[0].text, "first line");
  EXPECT_EQ(file.lines()[0].number, 3);
  EXPECT_EQ(file.lines()[1].text, "last");
  EXPECT_EQ(file.Where(file.lines()[1]), (folder.path() / "a.txt").string() + ":5");
}

TEST(TextFile, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  const std::string missing = (folder.path() / "missing.txt").string();
  EXPECT_EQ(ErrorOf([&] { TextFile file(missing); }),
            missing + ": cannot be opened: No such file or directory");
  EXPECT_EQ(ErrorOf([&] { TextFile file(folder.path()); }),
            folder.path().string() + ": is a folder: expected a file");
  const std::string big = folder.Write("big", std::string(100, 'x')).string();
  EXPECT_EQ(ErrorOf([&] { ReadBytes(big, 99); }),
            big + ": is too large: expected at most 99 bytes");
  EXPECT_EQ(ReadBytes(big, 100).size(), 100u);
  EXPECT_EQ(ReadHead(big, 10).size(), 10u);
}

TEST(Split, AtBlanksAndCommas) {
  std::vector<std::string_view> fields;
  SplitAtBlanks("  a \t b  ", &fields);
  EXPECT_EQ(fields, (std::vector<std::string_view>{"a", "b"}));
  SplitAtCommas("a, b ,,c", &fields);
  EXPECT_EQ(fields, (std::vector<std::string_view>{"a", "b", "", "c"}));
  SplitAtBlanks("", &fields);
  EXPECT_TRUE(fields.empty());
}

TEST(Quoted, IsOneShortLine) {
  EXPECT_EQ(Quoted("a\nb\x1b"), "'a?b?'");
  EXPECT_LT(Quoted(std::string(100000, 'x')).size(), 100u);
}

}  // namespace
}  // namespace deepuav
