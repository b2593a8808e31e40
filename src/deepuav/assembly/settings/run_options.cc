#include "deepuav/assembly/settings/run_options.h"

#include <cstdlib>
#include <filesystem>

#include "deepuav/assembly/settings/wrong_use.h"
#include "deepuav/base/option_check.h"
#include "deepuav/io/files/options_file.h"

namespace deepuav {
namespace {

std::string DefaultCacheFolder() {
  const auto folder = [](const char* variable) {  // set to nothing, it counts as not set
    const char* text = std::getenv(variable);
    return std::string(text ? text : "");
  };
  if (const std::string cache = folder("XDG_CACHE_HOME"); !cache.empty()) return cache + "/deepuav";
  if (const std::string home = folder("HOME"); !home.empty()) return home + "/.cache/deepuav";
  return "";
}

}  // namespace

bool RecognisesPlaces(const RunOptions& options) { return !options.places.vocabulary.empty(); }

bool NeedsSuperGlue(const RunOptions& options) { return options.matcher.method == "superglue"; }

std::unique_ptr<Matcher> MakeMatcher(const RunOptions& options, const Camera& camera) {
  if (NeedsSuperGlue(options)) {
    return std::make_unique<SuperGlueMatcher>(camera.width, camera.height, options.superglue,
                                              options.inference);
  }
  return std::make_unique<NearestNeighbourMatcher>(options.matching);
}

void MatcherChoice::Check() const { CheckOptions("matching", *this); }

void RunOptions::Check() const {
  images.Check();
  features.Check();
  inference.Check();
  matcher.Check();
  matching.Check();
  superglue.Check();
  if (NeedsSuperGlue(*this)) superglue.CheckModel();
  system.Check();
}

RunOptions RunOptions::OfPhotographs() const {
  RunOptions options = *this;
  options.features = features.OfPhotographs();
  return options;
}

void RunOptions::Register(OptionRegistry* registry) {
  registry->Add("images", &images);
  registry->Add("features", &network);
  registry->Add("features", &features);
  registry->Add("inference", &inference);
  registry->Add("matching", &matcher);
  registry->Add("matching", &matching);
  registry->Add("superglue", &superglue);
  registry->Add("places", &places);
  RegisterOptions(&system, registry);
}

std::unique_ptr<RunSettings> ReadSettings(const std::function<void(OptionRegistry*)>& set,
                                          const std::string& best_method) {
  const ModelRegistry& models = ShippedModels();
  auto settings = std::make_unique<RunSettings>();
  RunOptions* options = &settings->options;
  OptionRegistry* registry = &settings->registry;
  try {
    if (const ShippedModel* vocabulary = models.Vocabulary())
      registry->Set("places.vocabulary", vocabulary->file.string());
    registry->Set("inference.cache_dir", DefaultCacheFolder());
    set(registry);
    settings->asked = OptionTexts(*registry);
    settings->asked_yaml = OptionsAsYaml(*registry);
    options->inference.Check();
    options->features.model = NetworkFile(options->features.model, "superpoint",
                                          options->network.size, options->inference);
    if (options->matcher.method == "auto") {
      const bool is_shipped = models.Ships(options->features.model);
      options->matcher.method = is_shipped ? best_method : "nearest";
      options->matcher.may_ask_superglue = is_shipped && models.HasKind("superglue");
    }
    const bool is_asked = NeedsSuperGlue(*options) || options->matcher.may_ask_superglue;
    if (is_asked && models.HasKind("superglue")) {
      options->superglue.model = NetworkFile(options->superglue.model, "superglue", "",
                                             options->superglue.Inference(options->inference));
    }
    options->Check();
  } catch (const Error& error) {
    throw WrongUse("{}", error.what());
  }
  return settings;
}

std::vector<UsedModel> CheckModels(const RunOptions& options) {
  const ModelRegistry& models = ShippedModels();
  std::vector<UsedModel> used = {{"features", models.Check(options.features.model)}};
  if (NeedsSuperGlue(options)) used.push_back({"matcher", models.Check(options.superglue.model)});
  if (RecognisesPlaces(options))
    used.push_back({"vocabulary", models.Check(options.places.vocabulary)});
  return used;
}

std::map<std::string, std::string> OptionTexts(const OptionRegistry& registry) {
  std::map<std::string, std::string> texts;
  for (const auto& [name, entry] : registry.entries()) texts[name] = entry.get();
  return texts;
}

}  // namespace deepuav
