#include "deepuav/api/match.h"

#include "deepuav/api/conversions.h"
#include "deepuav/api/guarded.h"
#include "deepuav/api/options_data.h"
#include "deepuav/assembly/networks/pair_matcher.h"
#include "deepuav/assembly/settings/wrong_use.h"

namespace deepuav::api {
namespace {

PairMatcher MakeMatcher(const Options& options, const MatchSetup& setup) {
  constexpr int kSmallestSide = 8, kLargestSide = 16384;
  if (setup.max_side_px < kSmallestSide || setup.max_side_px > kLargestSide)
    throw WrongUse("longer side of {} px: expected {} to {}", setup.max_side_px, kSmallestSide,
                   kLargestSide);
  return {Access::Settings(options, "superglue")->options, setup.max_side_px, setup.headings,
          setup.refine};
}

std::vector<PointMatch> ToApi(const std::vector<PixelMatch>& matches) {
  std::vector<PointMatch> result;
  result.reserve(matches.size());
  for (const PixelMatch& match : matches) {
    result.push_back({match.a_px.x(), match.a_px.y(), match.b_px.x(), match.b_px.y(), match.score});
  }
  return result;
}

}  // namespace

struct Matcher::Data {
  PairMatcher matcher;
};

Matcher::Matcher(const Options& options, const MatchSetup& setup)
    : data_(Guarded([&] { return std::unique_ptr<Data>(new Data{MakeMatcher(options, setup)}); })) {
}
Matcher::Matcher(Matcher&& other) noexcept = default;
Matcher& Matcher::operator=(Matcher&& other) noexcept = default;
Matcher::~Matcher() = default;

std::vector<PointMatch> Matcher::Match(const ImageView& a, const ImageView& b) {
  return Guarded([&] { return ToApi(data_->matcher.MatchImages(GreyOf(a), GreyOf(b))); });
}

std::vector<PointMatch> Matcher::Match(const std::string& file_a, const std::string& file_b) {
  return Guarded([&] {
    return ToApi(
        data_->matcher.MatchImages(std::filesystem::path(file_a), std::filesystem::path(file_b)));
  });
}

}  // namespace deepuav::api
