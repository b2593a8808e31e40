#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/assembly/settings/shipped_models.h"
#include "deepuav/base/option_bounds.h"
#include "deepuav/base/options.h"
#include "deepuav/features/superpoint.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/matching/superglue.h"
#include "deepuav/system/slam.h"

namespace deepuav {

/// Which matcher finds the key points of one image in another without knowing their poses.
struct MatcherChoice {
  std::string method = "auto";
  /// SuperGlue may be asked for what another method leaves: `method` was auto, and the features are
  /// those that it learned from. Told by ReadSettings().
  bool may_ask_superglue = false;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit(
        "method", method, "",
        "nearest (neighbours in descriptor space), superglue (a network), or auto: superglue for "
        "pairs of images and for photographs that the others leave outside of a map, else nearest",
        OneOf({"auto", "nearest", "superglue"}));
  }
};

/// What places are recognised with.
struct PlaceOptions {
  std::string vocabulary;
  bool headings = true;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("vocabulary", vocabulary, "", "file of visual words; empty: no place is recognised");
    visit("headings", headings, "",
          "recognise places under every heading: costs a keyframe a run of the network for each "
          "that its map has seen places under, three while there are several maps");
  }
};

/// All options of a run.
struct RunOptions {
  DatasetOptions images;
  NetworkSize network;
  SuperPointOptions features;
  InferenceOptions inference;
  MatcherChoice matcher;
  NearestNeighbourOptions matching;
  SuperGlueOptions superglue;
  PlaceOptions places;
  SystemOptions system;

  void Check() const;
  void Register(OptionRegistry* registry);
  /// The same for images that are seen as SuperPointOptions::OfPhotographs.
  RunOptions OfPhotographs() const;
};

/// The options of a run and the names by which they are set: the one registry that command line,
/// files and library share.
struct RunSettings {
  RunSettings() { options.Register(&registry); }
  RunSettings(const RunSettings&) = delete;
  RunSettings& operator=(const RunSettings&) = delete;

  RunOptions options;
  OptionRegistry registry;  ///< Refers to `options`.
  /// As they were asked for, for a person and for --config: before `auto`, sizes of networks and
  /// what is known of a lens were replaced by what they stand for here.
  std::map<std::string, std::string> asked;
  std::string asked_yaml;
};

/// Defaults, then what `set` does; where that names no file, the shipped ones. Throws WrongUse for
/// options that are unknown or impossible.
/// `best_method`: the matching.method that auto stands for with a shipped SuperPoint; with another
/// network it stands for nearest, as nothing is known of its descriptors.
std::unique_ptr<RunSettings> ReadSettings(const std::function<void(OptionRegistry*)>& set,
                                          const std::string& best_method = "nearest");

/// Without, a lost camera finds itself no more and no map is found again.
bool RecognisesPlaces(const RunOptions& options);
bool NeedsSuperGlue(const RunOptions& options);

std::map<std::string, std::string> OptionTexts(const OptionRegistry& registry);

/// The networks and the vocabulary that a run with the options loads. Throws Error for one that is
/// missing or not as shipped.
std::vector<UsedModel> CheckModels(const RunOptions& options);
std::unique_ptr<Matcher> MakeMatcher(const RunOptions& options, const Camera& camera);

}  // namespace deepuav
