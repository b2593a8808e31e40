#include "support/fuzzing.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>

#include "deepuav/base/error.h"
#include "deepuav/base/time.h"

namespace deepuav {
namespace {

using Strings = std::vector<std::string>;

constexpr uint64_t kSeed = 20240517;
constexpr double kMaxSecondsPerInput = 10;  // a hang, even on a busy machine under a sanitizer
constexpr int64_t kMaxMemoryGrowthKiB = 1 << 20;  // of the whole run
constexpr size_t kMaxInputBytes = 1 << 16;

// What has broken parsers of numbers, text and YAML before.
const Strings& Tokens() {
  static const Strings tokens = {"1e9",
                                 "-1",
                                 "0",
                                 "nan",
                                 "-inf",
                                 ".nan",
                                 "1e999",
                                 "1e-999",
                                 "99999999999999999999999999999999",
                                 "-9223372036854775808",
                                 "9223372036.854775807",
                                 "2147483648",
                                 "0x7fffffff",
                                 "1e2147483647",
                                 "1e-2147483648",
                                 std::string(400, '9'),
                                 std::string(2000, '['),
                                 std::string(2000, '{'),
                                 std::string(300, '-') + " ",
                                 "&a ",
                                 "*a",
                                 "&a [*a, *a]",
                                 "<<: ",
                                 "? ",
                                 "!!binary ",
                                 "---\n",
                                 "%YAML 9.9\n",
                                 "|\n",
                                 "\"",
                                 "'",
                                 ":",
                                 ": ",
                                 ",",
                                 ",,,,,,,,,,",
                                 "#",
                                 "\r",
                                 "\n",
                                 "\t",
                                 std::string(1, '\0'),
                                 "\xEF\xBB\xBF",
                                 "\xff\xfe",
                                 "\xff\xd8\xff",
                                 "../../../../",
                                 "/dev/null",
                                 "~",
                                 "null"};
  return tokens;
}

/// Of an environment variable; `otherwise` where it is not set or no positive number.
int64_t NumberIn(const char* variable, int64_t otherwise) {
  const char* text = std::getenv(variable);
  const long long number = text ? std::atoll(text) : 0;
  return number > 0 ? number : otherwise;
}

int64_t PeakMemoryKiB() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

}  // namespace

uint64_t FuzzSeed() {
  return static_cast<uint64_t>(NumberIn("DEEPUAV_FUZZ_SEED", static_cast<int64_t>(kSeed)));
}

Mutator::Mutator(const Strings* seeds) : random_(FuzzSeed()), seeds_(seeds) {}

std::string Mutator::Next() {
  std::string input = AnySeed();
  for (int left = 1 + random_.Index(4); left > 0; --left) Mutate(&input);
  if (input.size() > kMaxInputBytes) input.resize(kMaxInputBytes);
  return input;
}

const std::string& Mutator::AnySeed() {
  return (*seeds_)[static_cast<size_t>(random_.Index(static_cast<int>(seeds_->size())))];
}
size_t Mutator::Position(const std::string& input) {
  return static_cast<size_t>(random_.Index(static_cast<int>(input.size()) + 1));
}
std::pair<size_t, size_t> Mutator::Stretch(const std::string& input, int longest) {
  const size_t start = Position(input);
  return {start, std::min(static_cast<size_t>(random_.Index(longest)), input.size() - start)};
}

void Mutator::Mutate(std::string* input) {
  switch (random_.Index(9)) {
    case 0:
      return FlipBytes(input);
    case 1:
      input->resize(Position(*input));
      return;
    case 2: {
      const auto [start, length] = Stretch(*input, 64);
      input->erase(start, length);
      return;
    }
    case 3: {
      const auto [start, length] = Stretch(*input, 256);
      input->insert(Position(*input), input->substr(start, length));
      return;
    }
    case 4: {
      const std::string& other = AnySeed();
      const size_t cut = Position(*input);
      *input = input->substr(0, cut) + other.substr(Position(other));
      return;
    }
    case 5:
      input->insert(Position(*input), AnyToken());
      return;
    case 6:
      return ReplaceNumber(input);
    case 7:
      return MoveLine(input);
    default:
      return FlipBytes(input);
  }
}

const std::string& Mutator::AnyToken() {
  return Tokens()[static_cast<size_t>(random_.Index(static_cast<int>(Tokens().size())))];
}

void Mutator::FlipBytes(std::string* input) {
  for (int left = 1 + random_.Index(8); left > 0 && !input->empty(); --left) {
    const size_t at = Position(*input) % input->size();
    constexpr char kInteresting[] = {'\0', '\x7f', '\x80', '\xff', '-', '9'};
    const bool random_byte = random_.Index(2) == 0;
    (*input)[at] =
        random_byte ? static_cast<char>(random_.Index(256)) : kInteresting[random_.Index(6)];
  }
}

void Mutator::ReplaceNumber(std::string* input) {
  const size_t start = input->find_first_of("0123456789", Position(*input));
  if (start == std::string::npos) return;
  const size_t end = std::min(input->find_first_not_of("0123456789.eE+-", start), input->size());
  input->replace(start, end - start, AnyToken());
}

void Mutator::MoveLine(std::string* input) {
  const size_t start = std::min(input->find('\n', Position(*input)), input->size());
  const size_t end = std::min(input->find('\n', start + 1), input->size());
  const std::string line = input->substr(start, end - start);
  if (random_.Index(2) == 0) input->erase(start, end - start);
  if (random_.Index(2) == 0) input->insert(Position(*input), line);
}

FuzzCounts FuzzInputs(int base_count, const std::function<void(int64_t input)>& read_next) {
  const int64_t count = base_count * NumberIn("DEEPUAV_FUZZ_FACTOR", 1);
  const int64_t seconds = NumberIn("DEEPUAV_FUZZ_SECONDS", 0);
  const int64_t memory_before = PeakMemoryKiB();
  int64_t refused = 0, i = 0;
  const Stopwatch since_start;
  for (; seconds > 0 ? since_start.Seconds() < static_cast<double>(seconds) : i < count; ++i) {
    if (::testing::Test::HasFailure()) break;
    const Stopwatch watch;
    try {
      read_next(i);
    } catch (const Error& error) {
      ++refused;
      EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos)
          << "input " << i << ": " << error.what();
    } catch (const std::exception& exception) {
      ADD_FAILURE() << "input " << i << ": not an Error: " << exception.what();
    }
    EXPECT_LT(watch.Seconds(), kMaxSecondsPerInput) << "input " << i;
    EXPECT_LT(PeakMemoryKiB() - memory_before, kMaxMemoryGrowthKiB) << "input " << i;
  }
  ::testing::Test::RecordProperty("inputs", std::to_string(i));
  return {i, refused};
}

void Fuzz(const Strings& seeds, int base_count, const std::function<void(const std::string&)>& read,
          double min_refused_share) {
  for (const std::string& seed : seeds) ASSERT_NO_THROW(read(seed));
  Mutator mutator(&seeds);
  const auto [inputs, refused] = FuzzInputs(base_count, [&](int64_t) { read(mutator.Next()); });
  EXPECT_GE(static_cast<double>(refused), min_refused_share * static_cast<double>(inputs));
}

}  // namespace deepuav
