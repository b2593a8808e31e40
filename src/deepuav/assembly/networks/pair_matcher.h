#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <list>
#include <memory>
#include <vector>

#include "deepuav/assembly/networks/any_size_extractor.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/patches/local_warp.h"
#include "deepuav/patches/patch_alignment.h"

namespace deepuav {

/// The same point in two images, in pixels of these as they are stored.
struct PixelMatch {
  Eigen::Vector2d a_px, b_px;
  float score = 0;  ///< As of the matcher, at most 1.
};

/// Matches images of any size by the options of a run. Images that come again soon are not seen
/// twice by the network.
class PairMatcher {
 public:
  /// Images are reduced to `max_side_px` along their longer side. With `headings` the first image
  /// is tried upright and turned by 90, 180 and 270 degrees, and the heading with the largest sum
  /// of scores is taken. Throws Error for a model that is missing, damaged or does not fit.
  /// With `refine` the place in the second image is measured by patches, where these agree.
  PairMatcher(const RunOptions& options, int max_side_px, bool headings, bool refine);
  PairMatcher(PairMatcher&& other) noexcept;
  ~PairMatcher();

  /// By falling score. Throws Error naming an image that cannot be read.
  std::vector<PixelMatch> MatchImages(const std::filesystem::path& a,
                                      const std::filesystem::path& b);
  /// The same of images that are there; they are not remembered.
  std::vector<PixelMatch> MatchImages(const GreyImage& a, const GreyImage& b);

 private:
  struct SeenImage;

  std::shared_ptr<const SeenImage> See(const std::filesystem::path& file);
  std::shared_ptr<SeenImage> Look(ReducedImage reduced);
  std::vector<PixelMatch> MatchSeen(const SeenImage& a, const SeenImage& b);
  /// Moves the places in b to where the patches around those in a are found, both as reduced.
  void Refine(const SeenImage& a, const SeenImage& b, std::vector<PointPair>* pairs) const;
  std::vector<Match> MatchHeading(const SeenImage& a, const SeenImage& b, int quarter_turns);

  const int max_side_px_;
  const bool headings_, refine_;
  const PatchOptions patches_;
  AnySizeExtractor extractor_;
  std::unique_ptr<Matcher> matcher_;
  SuperGlueMatcher* superglue_ = nullptr;             ///< The matcher, where it is one.
  std::list<std::shared_ptr<const SeenImage>> seen_;  ///< The last used first.
};

/// "x0 y0 x1 y1 score" a line.
std::string MatchesText(const std::vector<PixelMatch>& matches);

}  // namespace deepuav
