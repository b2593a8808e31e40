#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "deepuav/features/stored_descriptors.h"
#include "deepuav/image/image_store.h"
#include "deepuav/map/frame.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/survey/survey_options.h"

namespace deepuav {

/// A photograph as the survey sees it.
struct SurveyView {
  static constexpr int kMostHalvings = 2;

  Frame frame;  ///< Its image: null where `images` has it.
  /// Of its key points turned clockwise by one, two and three quarters, or without rows. A pair
  /// needs one of both turned: three quarters of one are one of the other.
  std::array<StoredDescriptors, 3> turned;
  /// Of the photograph as it is, at half and at a quarter of its size: the frame's are then all of
  /// these, one after the other. Empty until it was looked at reduced.
  std::vector<std::shared_ptr<const Features>> features_by_halvings = {};

  ImageStore* images = nullptr;  ///< Must outlive the view.
  int image_number = -1;         ///< Among these.

  /// Where a receiver says that it was taken, about: east, north and up of a place near all of
  /// them.
  std::optional<Eigen::Vector3d> position_m = {};

  /// Null: none was kept. Throws Error where it cannot be read back.
  std::shared_ptr<const ImagePyramid> Image() const {
    return images ? images->At(image_number) : frame.image;
  }
  bool HasImage() const { return images || frame.image; }
  int Halvings() const { return std::max(0, static_cast<int>(features_by_halvings.size()) - 1); }
  const Features& FeaturesAt(int halvings) const;
  /// Of those at so many halvings among the frame's.
  int FirstKeypoint(int halvings) const;
};

/// Two photographs that may show the same ground.
struct PairCandidate {
  int a = 0, b = 0;
  int quarter_turns = 0;    ///< Clockwise, of a, after which it looks like b.
  int halvings = 0;         ///< Of the size of a; negative: of b.
  int common_halvings = 0;  ///< Of both, besides: what a blur leaves is then alike.

  auto operator<=>(const PairCandidate&) const = default;
};

/// Two photographs that show the same ground: a < b, the matches agree with one epipolar geometry.
struct MatchedPair {
  int a = 0, b = 0;
  std::vector<Match> matches;
  std::optional<double> coverage = {};  ///< MatchCoverage(), once it was asked for.
};

/// Matches pairs of photographs whose lens is not known: an epipolar geometry of the pixels as they
/// are must hold for them.
class PairMatching {
 public:
  /// `learned` (may be null) is asked where the quick matcher finds little between photographs
  /// taken one after the other. The pointers must outlive it.
  PairMatching(const std::vector<SurveyView>* views, Matcher* quick, Matcher* learned,
               const SurveyOptions& options);

  /// From now on `progress` is told how many of all candidates are done.
  void Tell(std::function<void(int done, int total)> progress) { progress_ = std::move(progress); }

  /// Of several headings of one pair the one with most matches counts. `stop` ends it early.
  std::vector<MatchedPair> Match(const std::vector<PairCandidate>& candidates,
                                 const std::function<bool()>& stop);

 private:
  std::vector<deepuav::Match> MatchCandidate(const PairCandidate& candidate);
  std::vector<deepuav::Match> MatchTurned(const PairCandidate& candidate);
  std::vector<deepuav::Match> MatchUpright(const PairCandidate& candidate);
  std::vector<deepuav::Match> MatchReduced(const PairCandidate& candidate);
  std::vector<deepuav::Match> Verify(const PairCandidate& candidate,
                                     const std::vector<deepuav::Match>& matches) const;

  const std::vector<SurveyView>* views_;
  Matcher* quick_;
  Matcher* learned_;
  const SurveyOptions options_;
  std::function<void(int, int)> progress_;
};

}  // namespace deepuav
