#include <algorithm>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <span>

#include "arguments/argument_checks.h"
#include "arguments/option_arguments.h"
#include "commands/commands.h"
#include "deepuav/assembly/networks/any_size_extractor.h"
#include "deepuav/assembly/settings/shipped_models.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/files/atomic_file.h"
#include "deepuav/place/vocabulary_training.h"
#include "work/progress_bar.h"
#include "work/training_images.h"

namespace deepuav {
namespace {

struct TrainVocabArguments {
  std::filesystem::path images, out;
  std::string log_level = "info";
  OptionArguments options;
  std::vector<std::string> excluded;
  int max_images = 1000;
  int max_side_px = 640;
};

struct TrainVocabOptions {
  NetworkSize network;
  SuperPointOptions features;
  InferenceOptions inference;
  VocabularyOptions vocabulary;

  void Check() const {
    features.Check();
    inference.Check();
    vocabulary.Check();
  }
};

/// Options that are unknown or impossible are wrong use.
TrainVocabOptions ReadOptions(const OptionArguments& arguments) {
  ShippedModels();  // unreadable, they are no wrong use
  try {
    TrainVocabOptions options;
    OptionRegistry registry;
    registry.Add("features", &options.network);
    registry.Add("features", &options.features);
    registry.Add("inference", &options.inference);
    registry.Add("vocabulary", &options.vocabulary);
    SetOptions(arguments, &registry);
    options.inference.Check();
    options.features.model =
        NetworkFile(options.features.model, "superpoint", options.network.size, options.inference);
    options.Check();
    return options;
  } catch (const Error& error) {
    throw CLI::ValidationError(error.what());
  }
}

struct LoadedImage {
  std::filesystem::path file;
  GreyImage image;
};

/// By size. Images that cannot be read are logged and left out.
std::vector<LoadedImage> LoadImages(const std::vector<std::filesystem::path>& files,
                                    int max_side_px) {
  std::vector<LoadedImage> images;
  for (const std::filesystem::path& file : files) {
    try {
      images.push_back({file, LoadReduced(file, max_side_px).image});
    } catch (const Error& error) {
      Log().warn("left out: {}", error.what());
    }
  }
  std::stable_sort(images.begin(), images.end(), [](const LoadedImage& a, const LoadedImage& b) {
    return std::pair(a.image.cols, a.image.rows) < std::pair(b.image.cols, b.image.rows);
  });
  return images;
}

std::vector<Descriptors> DescribeAll(const std::vector<LoadedImage>& images,
                                     const TrainVocabOptions& options) {
  SuperPointOptions features = options.features.OfPhotographs();
  features.photograph_max_lookalikes = 1;  // Words are of what videos show, too.
  AnySizeExtractor extractor(features, options.inference);
  ProgressBar bar(static_cast<int>(images.size()), "images");
  std::vector<Descriptors> descriptors;
  for (const LoadedImage& loaded : images) {
    descriptors.push_back(extractor.Extract(loaded.image).descriptors);
    bar.Advance(static_cast<int>(descriptors.size()), "describing");
  }
  return descriptors;
}

void Report(const Vocabulary& vocabulary, std::span<const Descriptors> images, size_t sources,
            size_t bytes, const std::filesystem::path& out) {
  const QuantisationStatistics statistics = MeasureQuantisation(vocabulary, images);
  std::cout << fmt::format(
      "{}: {} words in {} levels for descriptors of dimension {}, {} bytes\n"
      "SHA-256 {}\n"
      "trained from {} descriptors of {} images of {} sources\n"
      "similarity of a descriptor and its word: {:.3f} (mean cosine)\n"
      "different words in an image: {:.1f} (mean)\n"
      "images that show a word: {:.1f} (mean), {:.1f} % (most common word)\n",
      out.string(), vocabulary.word_count(), vocabulary.depth(), vocabulary.dimension(), bytes,
      vocabulary.sha256(), statistics.descriptors, statistics.images, sources,
      statistics.mean_similarity, statistics.mean_words_per_image, statistics.mean_images_per_word,
      100 * statistics.largest_image_fraction);
}

void TrainVocab(const TrainVocabArguments& arguments) {
  LogToStderr(arguments.log_level);
  const TrainVocabOptions options = ReadOptions(arguments.options);
  const ImagesBySource sources = FindImages(arguments.images, arguments.excluded);
  // Before the work, not after it, it shows that the file cannot be written.
  ProbeOutput(arguments.out);
  ShippedModels().Check(options.features.model);
  const std::vector<Descriptors> images = DescribeAll(
      LoadImages(SampleEvenly(sources, arguments.max_images), arguments.max_side_px), options);
  const Vocabulary vocabulary = TrainVocabulary(images, options.vocabulary);
  const std::string bytes = vocabulary.Bytes();
  WriteFileAtomically(arguments.out, bytes);
  Report(vocabulary, images, sources.size(), bytes.size(), arguments.out);
}

void AddArguments(CLI::App& command, TrainVocabArguments& arguments) {
  constexpr int kMaxCount = std::numeric_limits<int>::max();
  command.add_option("IMAGES_DIR", arguments.images, "Photographs, also in folders below")
      ->required()
      ->check(NamedPath());
  command.add_option("--out", arguments.out, "File for the vocabulary")
      ->required()
      ->check(NamedOutput());
  command
      .add_option("--exclude", arguments.excluded,
                  "Folder below IMAGES_DIR to leave out; may be repeated")
      ->allow_extra_args(false);
  command
      .add_option("--max-images", arguments.max_images,
                  "Images used, taken evenly from the sources (see docs/places.md)")
      ->check(CLI::Range(1, kMaxCount).description(""))
      ->capture_default_str();
  command
      .add_option("--max-side", arguments.max_side_px,
                  "Larger images are reduced to this length of the longer side, px")
      ->check(CLI::Range(1, kMaxCount).description(""))
      ->capture_default_str();
  AddOptionArguments(command, arguments.options);
  AddFeaturesArguments(command, arguments.options);
  AddPrecisionArgument(command, arguments.options);
  AddLogLevelArgument(command, arguments.log_level);
}

}  // namespace

void AddTrainVocabCommand(CLI::App& app) {
  const auto arguments = std::make_shared<TrainVocabArguments>();
  CLI::App* command =
      app.add_subcommand("train-vocab", "Train the vocabulary by which places are known again");
  command->footer(
      "Example:\n"
      "  deepuav train-vocab photographs/ --out vocabulary.bin --set vocabulary.depth=4");
  AddArguments(*command, *arguments);
  command->callback([arguments] { TrainVocab(*arguments); });
}

}  // namespace deepuav
