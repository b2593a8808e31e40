#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deepuav/api/options.h"
#include "deepuav/api/types.h"

namespace deepuav::api {

/// The same point in two images, pixels of these as they are given.
struct PointMatch {
  double ax = 0, ay = 0, bx = 0, by = 0;
  double score = 0;  ///< 0 to 1.
};

struct MatchSetup {
  int max_side_px = 640;  ///< Images are reduced to it along their longer side.
  bool headings = false;  ///< Try the first image turned by 90, 180 and 270 degrees, too.
  bool refine = true;     ///< Measure the place in the second image by patches.
};

/// Matches pairs of images; keeps its networks. Thread-compatible.
class DEEPUAV_API Matcher {
 public:
  /// Throws Error for options that cannot be and networks that are missing or damaged.
  explicit Matcher(const Options& options = {}, const MatchSetup& setup = {});
  Matcher(Matcher&& other) noexcept;
  Matcher& operator=(Matcher&& other) noexcept;
  ~Matcher();

  /// By falling score. Throws Error for an image that is empty or cannot be read.
  std::vector<PointMatch> Match(const ImageView& a, const ImageView& b);
  std::vector<PointMatch> Match(const std::string& file_a, const std::string& file_b);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace deepuav::api
