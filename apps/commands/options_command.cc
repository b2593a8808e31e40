#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "arguments/option_arguments.h"
#include "commands/commands.h"
#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Json = nlohmann::ordered_json;

struct OptionsArguments {
  std::vector<std::string> words;
  OptionArguments options;
  bool as_json = false;
};

bool Speaks(const std::string& name, const OptionEntry& entry,
            const std::vector<std::string>& words) {
  return std::all_of(words.begin(), words.end(), [&](const std::string& word) {
    return name.find(word) != std::string::npos || entry.meaning.find(word) != std::string::npos;
  });
}

std::string TextRow(const std::string& name, const std::string& asked, const OptionEntry& entry) {
  std::string value = name + "=" + asked;
  if (!entry.unit.empty()) value += " " + entry.unit;
  if (!entry.bounds.empty()) value += " (" + entry.bounds + ")";
  return fmt::format("{}\n    {}\n", value, entry.meaning);
}

Json JsonRow(const std::string& name, const std::string& asked, const OptionEntry& entry) {
  return {{"name", name},
          {"value", asked},
          {"unit", entry.unit},
          {"bounds", entry.bounds},
          {"meaning", entry.meaning}};
}

void ListOptions(const OptionsArguments& arguments) {
  const auto settings = ReadRunSettings(arguments.options);
  Json table = Json::array();
  std::string text;
  for (const auto& [name, entry] : settings->registry.entries()) {
    if (!Speaks(name, entry, arguments.words)) continue;
    const std::string& asked = settings->asked.at(name);
    table.push_back(JsonRow(name, asked, entry));
    text += TextRow(name, asked, entry);
  }
  if (table.empty())
    throw Error("no option speaks of {}: without words, all are listed",
                fmt::format("{}", fmt::join(arguments.words, " and ")));
  std::cout << (arguments.as_json ? table.dump(2) + "\n" : text) << std::flush;
}

}  // namespace

void AddOptionsCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("options", "What --set and --config know, with units and bounds");
  const auto arguments = std::make_shared<OptionsArguments>();
  command->add_option("WORD", arguments->words, "Only options whose name or meaning has all words");
  AddOptionArguments(*command, arguments->options);
  command->add_flag("--json", arguments->as_json, "As JSON");
  command->footer(
      "Values are those that a run would have with the same --config and --set.\n"
      "Example:\n  deepuav options keyframe");
  command->callback([arguments] { ListOptions(*arguments); });
}

}  // namespace deepuav
