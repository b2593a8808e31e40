#include "commands/map_merge_command.h"

#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "deepuav/assembly/maps/map_joining.h"
#include "deepuav/assembly/settings/camera_checks.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/map/map_renumbering.h"

namespace deepuav {
namespace {

struct MergeArguments {
  std::vector<std::string> files;
  std::string out, log_level = "info";
  OptionArguments options;
};

void CheckSameNetwork(const std::string& file, const MapOrigin& origin, const std::string& first,
                      const MapOrigin& expected) {
  if (origin.features == expected.features) return;
  Log().warn("{}: made with {}, {} with {}: places may not be recognised", file, origin.features,
             first, expected.features);
}

/// Puts the maps of all files side by side; `newer` are those of all but the first.
LoadedAtlas LoadAll(const std::vector<std::string>& files, std::vector<MapId>* newer) {
  LoadedAtlas all = ReadMapFile(files.front());
  for (size_t i = 1; i < files.size(); ++i) {
    const LoadedAtlas more = ReadMapFile(files[i]);
    CheckSameCamera(files.front(), all.camera, more.camera, files[i] + "'s", false);
    CheckSameNetwork(files[i], more.origin, files.front(), all.origin);
    const MapId first_new = all.atlas.NextMap();
    const auto new_ids = TakeMaps(more.atlas, &all.atlas);
    for (MapId map : all.atlas.Remaining()) {
      if (map >= first_new) newer->push_back(map);
    }
    for (const auto& [keyframe, name] : more.origin.image_names)
      all.origin.image_names[new_ids.at(keyframe)] = name;
  }
  return all;
}

void Merge(const MergeArguments& arguments) {
  LogToStderr(arguments.log_level);
  const auto settings = ReadRunSettings(arguments.options);
  const RunOptions& options = settings->options;
  if (options.places.vocabulary.empty())
    throw CLI::ValidationError("option places.vocabulary is empty: expected a file");
  ShippedModels().Check(options.places.vocabulary);
  if (NeedsSuperGlue(options)) ShippedModels().Check(options.superglue.model);
  const Vocabulary vocabulary = Vocabulary::Load(options.places.vocabulary);
  RefuseInputAsOutput(arguments.out, {arguments.files.begin(), arguments.files.end()});
  std::vector<MapId> newer;
  LoadedAtlas all = LoadAll(arguments.files, &newer);
  ProbeOutput(arguments.out);
  const std::unique_ptr<Matcher> matcher = MakeMatcher(options, all.camera);
  NearestNeighbourMatcher quick(options.matching);
  Perception perception{nullptr, matcher.get(), &vocabulary};
  if (NeedsSuperGlue(options)) perception.quick_matcher = &quick;
  const JoiningReport report = JoinMaps(all.camera, options.system, perception, newer, &all.atlas);
  WriteMapFile(arguments.out, all.atlas, all.camera, all.origin);
  std::cout << fmt::format("{} joined to another, {} closed\n",
                           Counted(static_cast<size_t>(report.merged_maps), "map"),
                           Counted(static_cast<size_t>(report.closed_loops), "loop"));
  for (MapId id : all.atlas.Remaining()) {
    const Map& map = all.atlas.At(id);
    std::cout << fmt::format("map {}: {} keyframes, {} landmarks\n", id.value, map.KeyframeCount(),
                             map.LandmarkCount());
  }
}

}  // namespace

void AddMergeCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("merge", "Join the maps of several runs");
  const auto arguments = std::make_shared<MergeArguments>();
  constexpr int kFewest = 2;
  command->add_option("FILES", arguments->files, "Two map.deepuav or more")
      ->required()
      ->expected(kFewest, -1);
  command->add_option("--out", arguments->out, "File for all maps")
      ->required()
      ->check(NamedOutput());
  AddOptionArguments(*command, arguments->options);
  AddPrecisionArgument(*command, arguments->options);
  AddLogLevelArgument(*command, arguments->log_level);
  command->footer(
      "Maps that show a common place become one; the others stay beside one another in the file.\n"
      "Example:\n  deepuav map merge monday/map.deepuav tuesday/map.deepuav --out both.deepuav");
  command->callback([arguments] { Merge(*arguments); });
}

}  // namespace deepuav
