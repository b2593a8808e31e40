#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "commands/commands.h"
#include "deepuav/assembly/settings/run_options.h"
#include "work/interruption.h"

namespace deepuav {
namespace {

struct DemoArguments {
  std::string out = "out/demo", flight = "orbit";
  int frames = -1;
  OptionArguments networks;
};

/// Does what a user would who typed these words. Throws ExitStatus unless it succeeds.
void Step(const std::vector<std::string>& words) {
  std::string line = "deepuav";
  for (const std::string& word : words) line += " " + word;
  std::cout << "\n$ " << line << std::endl;
  const int status = RunProgram(words);
  if (status != 0) throw ExitStatus{status};
  ExitIfInterrupted();  // From the first step on signals wait for that.
}

std::vector<std::string> RunWords(const std::string& flight, const std::string& out,
                                  const OptionArguments& networks) {
  std::vector<std::string> words = {"run", flight, "--out", out};
  const auto add = [&words](const char* name, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {name, value});
  };
  add("--features", networks.features);
  add("--model", networks.model);
  add("--precision", networks.precision);
  return words;
}

/// Before the rendering, not after it, it shows that there is no such network.
void CheckNetworks(const OptionArguments& networks) {
  CheckModels(ReadRunSettings(networks)->options);
}

void Demo(const DemoArguments& arguments) {
  CheckNetworks(arguments.networks);
  const std::filesystem::path out = arguments.out;
  const std::string flight = out / "flight", run = out / "run", report = out / "report.html";
  Step({"simulate", "--flight", arguments.flight, "--out", flight, "--frames",
        std::to_string(arguments.frames)});
  Step(RunWords(flight, run, arguments.networks));
  Step({"eval", flight, run + "/trajectory.txt"});
  Step({"report", run, "--truth", flight, "--html", report});
  std::cout << "\nThe report: " << std::filesystem::absolute(report).string() << "\n";
}

}  // namespace

void AddDemoCommand(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("demo", "Simulate a flight, run SLAM on it, evaluate, write the report");
  const auto arguments = std::make_shared<DemoArguments>();
  command->add_option("--out", arguments->out, "Folder for everything")
      ->check(NamedOutput())
      ->capture_default_str();
  command->add_option("--flight", arguments->flight, "As of simulate")->capture_default_str();
  command->add_option("--frames", arguments->frames, "Render at most this many; -1: all")
      ->check(NumberOfFrames())
      ->capture_default_str();
  AddFeaturesArguments(*command, arguments->networks);
  AddPrecisionArgument(*command, arguments->networks);
  command->footer("Example:\n  deepuav demo --flight river --out out/river");
  command->callback([arguments] { Demo(*arguments); });
}

}  // namespace deepuav
