#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "arguments/argument_checks.h"
#include "commands/commands.h"
#include "deepuav/assembly/settings/shipped_models.h"
#include "deepuav/base/logging.h"
#include "deepuav/inference/cpu_arithmetic.h"
#include "work/network_bench.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

struct BenchArguments {
  std::string size = "752x480";
  std::vector<int> threads = {1, 2};
  std::vector<std::string> precisions;
  std::vector<std::string> models;
  NetworkBenchOptions options;
};

void ParseSize(const std::string& text, NetworkBenchOptions* options) {
  constexpr int kSmallest = 8, kLargest = 16384;
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, options->width_px);
  const bool has_height = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = has_height ? std::from_chars(width.ptr + 1, end, options->height_px) : width;
  const auto is_sensible = [](int px) { return px >= kSmallest && px <= kLargest; };
  if (has_height && height.ec == std::errc() && height.ptr == end &&
      is_sensible(options->width_px) && is_sensible(options->height_px)) {
    return;
  }
  throw CLI::ValidationError("--size is '" + text + "': expected WIDTHxHEIGHT, as 752x480");
}

/// The shipped networks, then the given ones.
std::vector<fs::path> NetworksOf(const BenchArguments& arguments) {
  std::vector<fs::path> files;
  for (const ShippedModel& model : ShippedModels().models()) {
    if (!model.precision.empty()) files.push_back(model.file);
  }
  files.insert(files.end(), arguments.models.begin(), arguments.models.end());
  return files;
}

/// Empty where the network can be timed so.
std::string WhyNot(const std::string& precision, bool is_quantised) {
  if (is_quantised != (precision == "int8")) return is_quantised ? "quantised" : "not quantised";
  return HasFastArithmetic(precision) ? "" : "not in this CPU";
}

void PrintRow(const std::string& network, const std::string& precision, const std::string& threads,
              const std::string& median, const std::string& range, const std::string& runs) {
  std::cout << fmt::format("| {} | {} | {} | {} | {} | {} |\n", network, precision, threads, median,
                           range, runs)
            << std::flush;
}

void PrintTiming(const std::string& network, int threads, const NetworkTiming& timing) {
  const std::string granted =
      timing.threads == threads ? "" : fmt::format(" ({} granted)", timing.threads);
  PrintRow(network, timing.precision, fmt::format("{}{}", threads, granted),
           fmt::format("{:.2f}", timing.median_ms),
           fmt::format("{:.2f} to {:.2f}", timing.p10_ms, timing.p90_ms),
           fmt::format("{}", timing.runs));
}

void TimeOne(const fs::path& file, const BenchArguments& arguments) {
  const std::string network = file.filename().string();
  const bool is_quantised = IsQuantisedNetwork(file);
  const bool all = arguments.precisions.empty();
  const std::vector<std::string> every = {"fp32", "bf16", "int8"};
  for (const std::string& precision : all ? every : arguments.precisions) {
    const bool fits = is_quantised == (precision == "int8");
    if (all && !fits) continue;
    const std::string reason = WhyNot(precision, is_quantised);
    if (!reason.empty()) {
      PrintRow(network, precision, "-", reason, "-", "-");
      continue;
    }
    for (const int threads : arguments.threads) {
      InferenceOptions inference;
      inference.threads = threads;
      inference.precision = precision;
      const NetworkTiming timing = TimeNetwork(file, inference, arguments.options);
      if (precision == "bf16" && timing.precision != precision) {
        PrintRow(network, precision, "-", "computed wrongly", "-", "-");
        break;
      }
      PrintTiming(network, threads, timing);
    }
  }
}

void BenchNetworks(BenchArguments arguments) {
  LogToStderr("error");
  ParseSize(arguments.size, &arguments.options);
  const std::vector<fs::path> networks = NetworksOf(arguments);
  for (const fs::path& file : networks) ShippedModels().Check(file);
  std::cout << fmt::format("{}; images of {}x{}, {} key points a side\n\n", CpuName(),
                           arguments.options.width_px, arguments.options.height_px,
                           arguments.options.points);
  PrintRow("network", "precision", "threads", "median ms", "10 % to 90 %, ms", "runs");
  std::cout << "|---|---|---|---|---|---|\n";
  for (const fs::path& file : networks) TimeOne(file, arguments);
}

void AddNetworksCommand(CLI::App& app) {
  constexpr int kMostThreads = 1024, kMostPoints = 100000;
  constexpr double kLongestS = 3600;
  CLI::App* command =
      app.add_subcommand("networks", "Time of each network by precision and threads");
  const auto arguments = std::make_shared<BenchArguments>();
  command->add_option("--size", arguments->size, "Images, px")->capture_default_str();
  command->add_option("--points", arguments->options.points, "Key points a side, for matchers")
      ->check(CLI::Range(1, kMostPoints).description(""))
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "Numbers of CPU threads, with commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Range(1, kMostThreads).description(""))
      ->capture_default_str();
  command
      ->add_option("--precisions", arguments->precisions,
                   "fp32, bf16, int8, with commas; else those that fit each network")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"fp32", "bf16", "int8"}));
  command->add_option("--model", arguments->models, "Further networks (.onnx or .xml)");
  command->add_option("--seconds", arguments->options.seconds, "For each line of the table")
      ->check(
          NumberThat([](double s) { return s >= 0 && s <= kLongestS; }, "a number from 0 to 3600"))
      ->capture_default_str();
  command->footer(
      "Prints a Markdown table. What else runs on the machine shows in it.\n"
      "Example:\n  deepuav bench networks --threads 1,2,4 --model superglue.onnx --points 1024");
  command->callback([arguments] { BenchNetworks(*arguments); });
}

}  // namespace

void AddBenchCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("bench", "The speed of the program on this machine");
  command->require_subcommand(1);
  AddNetworksCommand(*command);
}

}  // namespace deepuav
