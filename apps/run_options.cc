#include "run_options.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>

#include "deepuav/base/error.h"
#include "deepuav/io/options_file.h"

namespace deepuav {
namespace {

std::string DefaultCacheFolder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME")) return std::string(cache) + "/deepuav";
  if (const char* home = std::getenv("HOME")) return std::string(home) + "/.cache/deepuav";
  return "";
}

}  // namespace

std::unique_ptr<Matcher> MakeMatcher(const RunOptions& options, const Camera& camera) {
  if (options.matcher.method == "superglue") {
    return std::make_unique<SuperGlueMatcher>(camera.width, camera.height, options.superglue,
                                              options.inference);
  }
  return std::make_unique<NearestNeighbourMatcher>(options.matching);
}

void MatcherChoice::Check() const {
  if (method != "nearest" && method != "superglue") {
    throw Error("option matching.method is '{}': expected nearest or superglue", method);
  }
}

void RunOptions::Check() const {
  features.Check();
  inference.Check();
  matcher.Check();
  if (matcher.method == "superglue") {
    superglue.Check();
  } else {
    matching.Check();
  }
  system.Check();
}

void RunOptions::Register(OptionRegistry* registry) {
  registry->Add("features", &features);
  registry->Add("inference", &inference);
  registry->Add("matching", &matcher);
  registry->Add("matching", &matching);
  registry->Add("superglue", &superglue);
  registry->Add("places", &places);
  RegisterOptions(&system, registry);
}

void ReadOptions(const std::string& config_file, const std::vector<std::string>& assignments,
                 RunOptions* options, OptionRegistry* registry) try {
  options->Register(registry);
  registry->Set("features.model", DEEPUAV_MODELS "/superpoint_small.onnx");
  registry->Set("places.vocabulary", DEEPUAV_MODELS "/vocabulary.bin");
  registry->Set("inference.cache_dir", DefaultCacheFolder());
  if (!config_file.empty()) LoadOptionsFile(config_file, registry);
  for (const std::string& assignment : assignments) registry->SetAssignment(assignment);
  options->Check();
} catch (const Error& error) {
  throw CLI::ValidationError(error.what());
}

std::map<std::string, std::string> OptionTexts(const OptionRegistry& registry) {
  std::map<std::string, std::string> texts;
  for (const auto& [name, entry] : registry.entries()) texts[name] = entry.get();
  return texts;
}

Eyes::Eyes(const Camera& camera, const RunOptions& options)
    : extractor_(camera, options.features, options.inference),
      matcher_(MakeMatcher(options, camera)),
      vocabulary_file_(options.places.vocabulary) {
  if (vocabulary_file_.empty() || !options.system.looping.enabled) return;
  vocabulary_.emplace(Vocabulary::Load(vocabulary_file_));
  if (options.places.headings) {
    turned_.emplace(camera.width, camera.height, options.features.model, options.inference);
  }
}

Perception Eyes::perception() {
  return {&extractor_, matcher_.get(), vocabulary_ ? &*vocabulary_ : nullptr,
          turned_ ? &*turned_ : nullptr};
}

std::string Eyes::VocabularyDescription() const {
  if (!vocabulary_) return "";
  return std::filesystem::path(vocabulary_file_).filename().string() +
         " sha256:" + vocabulary_->sha256();
}

}  // namespace deepuav
