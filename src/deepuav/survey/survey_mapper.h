#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "deepuav/base/stages.h"
#include "deepuav/features/extractor.h"
#include "deepuav/features/turned_describer.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/map/atlas.h"
#include "deepuav/place/vocabulary.h"
#include "deepuav/survey/adjustment/survey_sharpening.h"
#include "deepuav/survey/growth/survey_growth.h"
#include "deepuav/survey/pairs/learned_pairs.h"
#include "deepuav/survey/pairs/pair_evidence.h"
#include "deepuav/survey/pairs/view_pairs.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_watch.h"

namespace deepuav {

/// What photographs are matched and recognised with. The pointers must outlive their user.
struct SurveyEyes {
  Matcher* quick = nullptr;
  Matcher* learned = nullptr;              ///< May be null.
  const Vocabulary* vocabulary = nullptr;  ///< Null: by the order of the photographs alone.
  LenslessExtractor* reduced = nullptr;    ///< Null: photographs are seen at their size alone.
  TurnedDescriber* turned = nullptr;       ///< Null: under the headings that views come with.
  TemporaryFile* turned_file = nullptr;    ///< Where what it gives waits; null: in memory.
  Matcher* of_outside = nullptr;  ///< For photographs that stay outside of the map; null: none.
};

/// What came of a survey.
struct SurveyOutcome {
  struct Place {
    MapId map;  ///< Invalid where the photograph is in none.
    KeyframeId keyframe;
  };
  Atlas atlas;                      ///< The map with most photographs first, as a rule.
  Camera camera;                    ///< As given, or refined.
  std::vector<Place> places;        ///< By view.
  std::optional<RefinedLens> lens;  ///< Where it was refined.
  std::vector<int> doubtful;        ///< Views that others contradict: PairJudge::Doubtful().
};

/// Makes maps of photographs that may come in any order, of a lens that may be a guess: all pairs
/// that may overlap are matched, maps grow from the pairs that start best, what overlaps in them is
/// matched again, and all is adjusted with the lens. Thread-compatible.
class SurveyMapper {
 public:
  /// `focal_sigma`: standard deviation of the focal length over it; 0 for a calibrated camera,
  /// which is kept. `stages` may be null.
  SurveyMapper(const Camera& camera, double focal_sigma, const SurveyOptions& options,
               const SurveyEyes& eyes, StageListener* stages,
               const SurveyMeasuring& measuring = {});

  /// `watch` (may be null) must outlive the survey.
  void Watch(SurveyWatch* watch) { watch_ = watch; }

  /// `stop`, if given, is asked between the steps; what is there then is given. The frames'
  /// features may grow: by what is seen at a part of the photographs' size.
  SurveyOutcome Run(std::vector<SurveyView> views, const std::function<bool()>& stop = nullptr);

 private:
  ViewPixels PixelsOfViews() const;
  std::optional<BuiltSurvey> Build(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                                   const std::function<bool()>& stop);
  std::optional<BuiltSurvey> MakeMap(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                                     const std::function<bool()>& stop);
  std::optional<BuiltSurvey> BeginMap(const std::set<int>& taken,
                                      const std::vector<MatchedPair>& pairs,
                                      const std::function<bool()>& stop);
  void CompleteMap(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                   const std::function<bool()>& stop, BuiltSurvey* built);
  bool Join(const std::set<int>& taken, const std::vector<MatchedPair>& pairs,
            const std::function<bool()>& stop, BuiltSurvey* built);
  bool ExplainsWhatLeads(const SurveyState& map, const BuiltSurvey& both,
                         const std::vector<MatchedPair>& pairs) const;
  bool PlaceElsewhere(std::vector<int> misplaced, const std::set<int>& taken,
                      std::vector<MatchedPair>* pairs, const std::function<bool()>& stop,
                      BuiltSurvey* built);
  void PlaceAgain(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                  const std::function<bool()>& stop, BuiltSurvey* built);
  bool TrustOrder(bool brings_in, const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                  const std::function<bool()>& stop, BuiltSurvey* built);
  void ResolveContradictions(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                             const std::function<bool()>& stop, BuiltSurvey* built);
  void GrowFurther(const std::set<int>& taken, const std::vector<MatchedPair>& pairs,
                   const std::function<bool()>& stop, BuiltSurvey* built);
  bool TellsFocal(const BuiltSurvey& built) const;
  std::optional<BuiltSurvey> FreeFocal(const std::set<int>& taken,
                                       const std::vector<MatchedPair>& pairs,
                                       const SurveySharpening& sharpening,
                                       const std::function<bool()>& stop, BuiltSurvey built);
  void BringIn(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
               const std::function<bool()>& stop, BuiltSurvey* built);
  std::set<int> Outside(const SurveyState& known, const std::set<int>& taken) const;
  /// Adds pairs; false where it found none.
  bool MatchReduced(const SurveyState& known, const std::set<int>& taken,
                    std::vector<MatchedPair>* pairs, const std::function<bool()>& stop);
  void MatchOverlaps(const BuiltSurvey& built, std::vector<MatchedPair>* pairs,
                     const std::function<bool()>& stop);
  PairJudge JudgeOfPairs() const;
  /// Whether matches say more against a map than for it, as of photographs from one place, where a
  /// wrong focal length feigns parallax.
  bool IsRefuted(const BuiltSurvey& built, std::vector<MatchedPair>* pairs) const;
  /// Tells whoever watches how many of `what` are done.
  std::function<void(int done, int total)> Telling(const char* what) const;
  PairMatching Matching() const;
  void GrowAll(const std::set<int>& taken, const std::function<bool()>& stop,
               SurveyGrowth* growth) const;

  const Camera camera_;
  const SurveyOptions options_;
  const SurveyEyes eyes_;
  StageListener* stages_;
  const SurveyMeasuring measuring_;
  SurveyWatch* watch_ = nullptr;
  MapId next_map_{0};
  SurveyLens lens_;
  bool keeps_distortion_ = false;  ///< Pixels are of the images as taken, for the lens is refined.
  std::vector<SurveyView> views_;
  ViewPixels px_;  ///< As detected.
  std::set<PairCandidate> tried_;
  std::optional<LearnedPairs> learned_;
};

}  // namespace deepuav
