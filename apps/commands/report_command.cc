#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include "arguments/argument_checks.h"
#include "arguments/evaluation_arguments.h"
#include "arguments/option_bounds_check.h"
#include "commands/commands.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/evaluation/drawing/report_plots.h"
#include "deepuav/evaluation/report/report_page.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/files/folder_lock.h"

namespace deepuav {
namespace {

constexpr const char* kPageName = "report.html";

struct ReportArguments {
  std::vector<std::filesystem::path> outs, truths;
  std::filesystem::path html, plots;
  EvaluationArguments evaluation;
  PictureOptions pictures;
  ReportPageOptions page;
};

/// The truth of run `index`: its own, the one for all, or none.
std::filesystem::path TruthOf(const ReportArguments& arguments, size_t index) {
  if (arguments.truths.empty()) return {};
  return arguments.truths.size() == 1 ? arguments.truths[0] : arguments.truths[index];
}

std::vector<RunFolder> ReadRuns(const ReportArguments& arguments) {
  std::vector<RunFolder> runs;
  for (const std::filesystem::path& out : arguments.outs) runs.push_back(ReadRunFolder(out));
  MakeNamesUnique(&runs);
  return runs;
}

std::vector<RunReport> MakeReports(const ReportArguments& arguments, std::vector<RunFolder> runs) {
  std::vector<RunReport> reports;
  for (size_t i = 0; i < runs.size(); ++i) {
    RunReport& report = reports.emplace_back();
    report.run = std::move(runs[i]);
    Evaluate(TruthOf(arguments, i), arguments.evaluation.options,
             arguments.evaluation.truth_options, &report);
    AddMap(arguments.pictures, &report);
  }
  return reports;
}

void WritePlots(const std::filesystem::path& folder, const std::vector<RunReport>& reports) {
  for (const auto& [name, svg] : ReportPlots(reports)) {
    WriteFileAtomically(folder / name, svg);
    std::cout << (folder / name).string() << "\n";
  }
}

/// Before the work, not after it, it shows that an output cannot be written.
void CheckOutputs(const ReportArguments& arguments, const std::filesystem::path& page) {
  RefuseInputAsOutput(page, arguments.truths);
  ProbeOutput(page);
  if (arguments.plots.empty()) return;
  MakeOutputFolder(arguments.plots);
  ProbeOutput(arguments.plots / "errors.svg");
}

void Report(ReportArguments arguments) {
  LogToStderr("warn");
  FinishEvaluationArguments(&arguments.evaluation);
  const size_t truths = arguments.truths.size(), outs = arguments.outs.size();
  if (truths > 1 && truths != outs) {
    throw CLI::ValidationError(fmt::format(
        "--truth names {} for {} runs: expected one for all or one each", truths, outs));
  }

  std::vector<RunFolder> runs = ReadRuns(arguments);
  const std::filesystem::path page =
      arguments.html.empty() ? arguments.outs[0] / kPageName : arguments.html;
  CheckOutputs(arguments, page);
  const std::vector<RunReport> reports = MakeReports(arguments, std::move(runs));
  WriteFileAtomically(page, ReportPage(reports, DEEPUAV_VERSION, arguments.page));
  std::cout << page.string() << "\n";
  if (!arguments.plots.empty()) WritePlots(arguments.plots, reports);
}

}  // namespace

void AddReportCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "report", "One self-contained HTML page on one run, or on several side by side");
  const auto arguments = std::make_shared<ReportArguments>();
  command->add_option("OUT", arguments->outs, "Output folders of runs")->required();
  command
      ->add_option("--truth", arguments->truths,
                   "Truth of all runs or, repeated, of each; default: what their datasets hold")
      ->allow_extra_args(false);
  command->add_option("--html", arguments->html, "The page; default: report.html in the first OUT")
      ->check(NamedOutput());
  command->add_option("--plots", arguments->plots, "Folder for the plots as SVG, made if absent")
      ->check(NamedOutput());
  command->add_option("--pairs", arguments->pictures.pairs, "Pairs of keyframes shown of each run")
      ->check(WithinBoundsOf<PictureOptions>("pairs"))
      ->capture_default_str();
  command->add_option("--points", arguments->page.max_points, "Most points of each cloud")
      ->check(WithinBoundsOf<ReportPageOptions>("max_points"))
      ->capture_default_str();
  AddEvaluationArguments(command, &arguments->evaluation);
  command->footer(
      "Examples:\n"
      "  deepuav report out/mh01\n"
      "  deepuav report out/mh01-small out/mh01-large --truth MH_01_easy --html compare.html\n"
      "  deepuav report out/flight --truth flight.gpx --search-offset 5 --plots figures");
  command->callback([arguments] { Report(*arguments); });
}

}  // namespace deepuav
