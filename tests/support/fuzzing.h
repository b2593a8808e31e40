#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "deepuav/base/random.h"

namespace deepuav {

/// Damages inputs: reproducible by the seed, which $DEEPUAV_FUZZ_SEED changes.
class Mutator {
 public:
  /// `seeds`, the inputs that are damaged, must outlive it.
  explicit Mutator(const std::vector<std::string>* seeds);

  std::string Next();

 private:
  const std::string& AnySeed();
  size_t Position(const std::string& input);
  /// A stretch of up to `longest` bytes: start and length.
  std::pair<size_t, size_t> Stretch(const std::string& input, int longest);
  void Mutate(std::string* input);
  const std::string& AnyToken();
  void FlipBytes(std::string* input);
  void ReplaceNumber(std::string* input);
  void MoveLine(std::string* input);

  Random random_;
  const std::vector<std::string>* seeds_;
};

/// What all inputs are drawn by: $DEEPUAV_FUZZ_SEED, where it is set.
uint64_t FuzzSeed();

struct FuzzCounts {
  int64_t inputs = 0;
  int64_t refused = 0;  ///< With an Error.
};

/// Has `read_next` draw and read input after input, which must return or throw Error with one line,
/// soon and in little memory: `base_count` times $DEEPUAV_FUZZ_FACTOR of them or, where
/// $DEEPUAV_FUZZ_SECONDS is set, as many as that time allows.
FuzzCounts FuzzInputs(int base_count, const std::function<void(int64_t input)>& read_next);

/// The same of damaged seeds. At least a share must be refused, and the seeds themselves must pass.
void Fuzz(const std::vector<std::string>& seeds, int base_count,
          const std::function<void(const std::string&)>& read, double min_refused_share = 0.05);

}  // namespace deepuav
