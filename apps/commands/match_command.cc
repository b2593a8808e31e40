#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "commands/commands.h"
#include "deepuav/assembly/networks/pair_matcher.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/files/folder_lock.h"
#include "work/match_picture.h"
#include "work/pair_list.h"
#include "work/progress_bar.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

struct MatchArguments {
  std::string a, b, pairs, images, picture, log_level = "info";
  fs::path out;
  bool draw = false, headings = false, refine = true;
  int max_side_px = 640;
  OptionArguments options;
};

/// What is drawn is a PNG, and a name that says otherwise misleads who opens it.
bool CanBeNamed(const fs::path& picture) {
  std::string ending = picture.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending.empty() || ending == ".png";
}

void CheckUse(const MatchArguments& arguments) {
  const auto refuse = [](const std::string& message) { throw CLI::ValidationError(message); };
  if (!arguments.pairs.empty() && !arguments.a.empty())
    refuse("two images or --pairs: expected one of them");
  if (arguments.pairs.empty() && arguments.b.empty()) {
    refuse(arguments.picture.empty()
               ? "expected two images, or a list of them by --pairs"
               : "expected two images before --draw, which takes a word behind it as its file");
  }
  // A check of the argument would see what it has without a word behind it, too.
  if (const std::string fault = NamedOutput()(arguments.picture);
      !fault.empty() && !arguments.picture.empty())
    refuse("--draw: " + fault);
  if (!CanBeNamed(arguments.picture))
    refuse("--draw writes PNG: expected a file that ends in .png");
  if (arguments.pairs.empty()) return;
  if (arguments.draw && arguments.out.empty()) refuse("--draw of --pairs: expected --out");
  if (!arguments.picture.empty())
    refuse("--draw of --pairs takes no file: the pictures go into the folder of --out");
}

std::vector<ImagePair> PairsOf(const MatchArguments& arguments) {
  if (arguments.pairs.empty()) return {{arguments.a, arguments.b, ""}};
  return ReadPairList(arguments.pairs, arguments.images);
}

/// The least score that the matcher lets pass.
double LowestScore(const RunOptions& options) {
  return NeedsSuperGlue(options) ? options.superglue.min_score
                                 : std::max(0.0, options.matching.min_similarity);
}

/// The same for all names of a file.
fs::path Resolved(const fs::path& file) {
  std::error_code error;  // A file that cannot be looked for is found so when it is read.
  const fs::path resolved = fs::weakly_canonical(file, error);
  return error ? file : resolved;
}

void RefuseInput(const fs::path& output, const std::set<fs::path>& inputs) {
  if (inputs.contains(Resolved(output)))
    throw Error("{}: is the input: expected another file", output.string());
}

class MatchWriter {
 public:
  MatchWriter(const MatchArguments& arguments, const RunOptions& options)
      : arguments_(arguments), lowest_score_(LowestScore(options)) {
    if (!arguments_.out.empty()) MakeOutputFolder(arguments_.out);
  }

  /// Before the work, not after it, it shows that files cannot be written or would replace inputs.
  void Probe(const std::vector<ImagePair>& pairs) const {
    std::set<fs::path> inputs;
    if (!arguments_.pairs.empty()) inputs.insert(Resolved(arguments_.pairs));
    for (const ImagePair& pair : pairs) inputs.insert({Resolved(pair.a), Resolved(pair.b)});
    for (size_t i = 0; i < pairs.size(); ++i) {
      if (!arguments_.out.empty()) RefuseInput(FileOf(i, "txt"), inputs);
      if (arguments_.draw) RefuseInput(PictureOf(i), inputs);
    }
    if (!arguments_.out.empty()) ProbeOutput(FileOf(0, "txt"));
    if (arguments_.draw) ProbeOutput(PictureOf(0));
  }

  void Write(size_t index, const ImagePair& pair, const std::vector<PixelMatch>& matches) {
    counts_.push_back(matches.size());
    if (!arguments_.out.empty()) {
      WriteFileAtomically(FileOf(index, "txt"), MatchesText(matches));
    } else {
      if (!arguments_.pairs.empty())
        std::cout << fmt::format("# {} {} {}\n", index, pair.a.string(), pair.b.string());
      std::cout << MatchesText(matches);
    }
    if (!arguments_.draw) return;
    WriteMatchPicture(PictureOf(index), pair.a, pair.b, matches, arguments_.max_side_px,
                      lowest_score_);
  }

  void Report() const {
    if (arguments_.out.empty()) return;
    std::vector<size_t> sorted = counts_;
    std::sort(sorted.begin(), sorted.end());
    std::cout << fmt::format("{}: {}, {} to {} matches, median {}\n", arguments_.out.string(),
                             Counted(sorted.size(), "pair"), sorted.front(), sorted.back(),
                             sorted[sorted.size() / 2]);
  }

 private:
  fs::path FileOf(size_t index, const char* ending) const {
    return arguments_.out / fmt::format("{:05}.{}", index, ending);
  }
  fs::path PictureOf(size_t index) const {
    if (!arguments_.picture.empty()) return arguments_.picture;
    return arguments_.out.empty() ? fs::path("matches.png") : FileOf(index, "png");
  }

  const MatchArguments& arguments_;
  const double lowest_score_;
  std::vector<size_t> counts_;
};

std::vector<PixelMatch> MatchPair(const ImagePair& pair, PairMatcher* matcher) try {
  return matcher->MatchImages(pair.a, pair.b);
} catch (const Error& error) {
  if (pair.where.empty()) throw;
  throw Error("{}: {}", pair.where, error.what());
}

void MatchAll(const MatchArguments& arguments) {
  CheckUse(arguments);
  LogToStderr(arguments.log_level);
  const auto settings = ReadRunSettings(arguments.options, "superglue");
  const RunOptions& options = settings->options;
  const std::vector<ImagePair> pairs = PairsOf(arguments);
  MatchWriter writer(arguments, options);
  writer.Probe(pairs);
  PairMatcher matcher(options, arguments.max_side_px, arguments.headings, arguments.refine);
  {
    ProgressBar bar(static_cast<int>(pairs.size()), "pairs");
    for (size_t i = 0; i < pairs.size(); ++i) {
      writer.Write(i, pairs[i], MatchPair(pairs[i], &matcher));
      bar.Advance(static_cast<int>(i) + 1, "matching");
    }
  }
  writer.Report();
}

void AddArguments(CLI::App& command, MatchArguments& arguments) {
  constexpr int kSmallestSide = 8, kLargestSide = 16384;
  command.add_option("A", arguments.a, "First image");
  command.add_option("B", arguments.b, "Second image");
  CLI::Option* pairs = command.add_option(
      "--pairs", arguments.pairs, "List of pairs, 'path0 path1' a line; more columns are ignored");
  command
      .add_option("--images", arguments.images,
                  "Folder that relative paths of the list start from; else the working folder")
      ->needs(pairs)
      ->check(CLI::ExistingDirectory);
  command
      .add_option("--out", arguments.out,
                  "Folder for 00000.txt, ... with 'x0 y0 x1 y1 score' a line; else stdout")
      ->check(NamedOutput());
  command
      .add_option(
          "--draw", arguments.picture,
          "Draw the matches, coloured by score: into the folder of --out as 00000.png, ..., "
          "else into matches.png or this file")
      ->expected(0, 1)
      ->type_name("[FILE]");
  command.add_flag("--headings", arguments.headings,
                   "Try the first image turned by 90, 180 and 270 degrees, too");
  command.add_flag("--refine,!--no-refine", arguments.refine,
                   "Measure places in the second image by patches of the first (the default)");
  command
      .add_option("--max-side", arguments.max_side_px,
                  "Larger images are reduced to this length of the longer side, px")
      ->check(CLI::Range(kSmallestSide, kLargestSide).description(""))
      ->capture_default_str();
  AddOptionArguments(command, arguments.options);
  AddFeaturesArguments(command, arguments.options);
  AddPrecisionArgument(command, arguments.options);
  AddLogLevelArgument(command, arguments.log_level);
}

}  // namespace

void AddMatchCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("match", "Points that two images have in common");
  const auto arguments = std::make_shared<MatchArguments>();
  AddArguments(*command, *arguments);
  command->footer(
      "Positions are pixels of the images as stored, (0, 0) the centre of the top-left one.\n"
      "Examples:\n"
      "  deepuav match a.jpg b.jpg --draw matches.png\n"
      "  deepuav match --pairs pairs.txt --images photographs --out matches --draw");
  command->callback([arguments, command] {
    arguments->draw = command->count("--draw") > 0;
    MatchAll(*arguments);
  });
}

}  // namespace deepuav
