#include "deepuav/io/model_registry.h"

#include <algorithm>
#include <array>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/inference/session.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/files/yaml_map.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr char kFileName[] = "models.yaml";
constexpr char kSuperPoint[] = "superpoint", kSuperGlue[] = "superglue",
               kVocabulary[] = "vocabulary";
constexpr char kFloat[] = "fp32", kInt8[] = "int8";
constexpr size_t kSha256Digits = 64;

std::string OneOf(const YamlMap& map, const std::string& key,
                  std::initializer_list<const char*> allowed) {
  const std::string text = map.Text(key);
  std::string expected;
  for (const char* word : allowed) {
    if (text == word) return text;
    expected += (expected.empty() ? "" : ", ") + std::string(word);
  }
  throw Error("{}: {} is {}: expected one of {}", map.Where(key), map.Name(key), Quoted(text),
              expected);
}

std::string NonEmpty(const YamlMap& map, const std::string& key) {
  const std::string text = map.Text(key);
  if (text.empty()) throw Error("{}: {} is empty", map.Where(key), map.Name(key));
  return text;
}

/// In the folder itself, so that a registry cannot point elsewhere.
fs::path FileIn(const fs::path& folder, const YamlMap& map, const std::string& key) {
  const fs::path name = NonEmpty(map, key);
  if (name.has_parent_path()) {
    throw Error("{}: {} is {}: expected the name of a file beside {}", map.Where(key),
                map.Name(key), Quoted(name.string()), kFileName);
  }
  return folder / name;
}

std::string ReadSha256(const YamlMap& map, const std::string& key) {
  const std::string text = map.Text(key);
  if (text.size() != kSha256Digits ||
      text.find_first_not_of("0123456789abcdef") != std::string::npos) {
    throw Error("{}: {} is {}: expected {} lower-case hexadecimal digits", map.Where(key),
                map.Name(key), Quoted(text), kSha256Digits);
  }
  return text;
}

ShippedModel ReadModel(const fs::path& folder, const std::string& name, const YamlMap& map) {
  static const std::array<std::string, 7> kKnown = {"kind",   "size",    "precision", "file",
                                                    "sha256", "licence", "card"};
  map.RequireKnown(kKnown);
  ShippedModel model;
  model.name = name;
  model.kind = OneOf(map, "kind", {kSuperPoint, kSuperGlue, kVocabulary});
  if (model.kind != kVocabulary) model.precision = OneOf(map, "precision", {kFloat, kInt8});
  if (model.kind == kSuperPoint) model.size = NonEmpty(map, "size");
  for (const char* key : {"precision", "size"}) {
    const bool is_used =
        std::string(key) == "size" ? !model.size.empty() : !model.precision.empty();
    if (map.Has(key) && !is_used) {
      throw Error("{}: {}: a {} has none", map.Where(key), map.Name(key), model.kind);
    }
  }
  model.file = FileIn(folder, map, "file");
  model.sha256 = ReadSha256(map, "sha256");
  model.licence = NonEmpty(map, "licence");
  model.card = FileIn(folder, map, "card");
  return model;
}

bool HaveSameUse(const ShippedModel& a, const ShippedModel& b) {
  return a.kind == b.kind && a.size == b.size && a.precision == b.precision;
}

std::string WithSize(const std::string& kind, const std::string& size) {
  return size.empty() ? kind : kind + " of size " + Quoted(size);
}

}  // namespace

ModelRegistry::ModelRegistry(const fs::path& folder) : folder_(folder) {
  const YamlMap map = YamlMap::Read(folder / kFileName);
  for (const auto& [name, field] : map.fields()) {
    ShippedModel model = ReadModel(folder, name, map.Map(name));
    for (const ShippedModel& other : models_) {
      if (HaveSameUse(model, other)) {
        throw Error("{}: {} has the kind, size and precision of {}: expected one model for each",
                    field.where, Quoted(name), Quoted(other.name));
      }
    }
    models_.push_back(std::move(model));
  }
}

bool ModelRegistry::HasKind(const std::string& kind) const {
  return std::any_of(models_.begin(), models_.end(),
                     [&](const ShippedModel& model) { return model.kind == kind; });
}

/// "small (fp32), small (int8), large (fp32)"
std::string ModelRegistry::Describe(const std::string& kind) const {
  std::string text;
  for (const ShippedModel& model : models_) {
    if (model.kind != kind) continue;
    text += text.empty() ? "" : ", ";
    text += model.size.empty() ? model.precision : model.size + " (" + model.precision + ")";
  }
  return text.empty() ? "none" : text;
}

const ShippedModel& ModelRegistry::Network(const std::string& kind, const std::string& size,
                                           const std::string& precision, bool int8_is_fast) const {
  const ShippedModel* floating = nullptr;
  const ShippedModel* quantised = nullptr;
  for (const ShippedModel& model : models_) {
    if (model.kind != kind || model.size != size) continue;
    (model.precision == kInt8 ? quantised : floating) = &model;
  }
  if (!floating && !quantised) {
    throw Error("no {} is shipped: there are {}", WithSize(kind, size), Describe(kind));
  }
  const bool wants_int8 = precision == kInt8 || (precision == "auto" && int8_is_fast);
  const ShippedModel* chosen = wants_int8 ? quantised : floating;
  if (!chosen && precision == "auto") chosen = floating ? floating : quantised;
  if (!chosen) {
    throw Error("no {} is shipped for the precision {}: there are {}", WithSize(kind, size),
                precision, Describe(kind));
  }
  return *chosen;
}

const ShippedModel* ModelRegistry::Vocabulary() const {
  for (const ShippedModel& model : models_) {
    if (model.kind == kVocabulary) return &model;
  }
  return nullptr;
}

/// Behind links too, by which the file of a model is still the shipped one.
const ShippedModel* ModelRegistry::FindFile(const fs::path& file) const {
  std::error_code unknown;
  const fs::path real = fs::weakly_canonical(file, unknown);
  for (const ShippedModel& model : models_) {
    if (real == fs::weakly_canonical(model.file, unknown)) return &model;
  }
  return nullptr;
}

CheckedModel ModelRegistry::Check(const fs::path& file) const {
  const ShippedModel* shipped = FindFile(file);
  std::error_code unknown;
  RefuseNamedPipe(file);
  if (!fs::is_regular_file(file, unknown)) {
    if (shipped) {
      throw Error("{}: no such file: expected the shipped model {} with the SHA-256 {}",
                  file.string(), shipped->name, shipped->sha256);
    }
    throw Error("{}: no such file: expected a model", file.string());
  }
  CheckedModel checked{shipped ? shipped->name : "", file, ModelSha256(file)};
  if (shipped && checked.sha256 != shipped->sha256) {
    throw Error("{}: has the SHA-256 {}: expected {} of the shipped model {}", file.string(),
                checked.sha256, shipped->sha256, shipped->name);
  }
  return checked;
}

ModelState ModelRegistry::StateOf(const ShippedModel& model) {
  std::error_code unknown;
  if (!fs::is_regular_file(model.file, unknown)) return ModelState::kMissing;
  try {
    return ModelSha256(model.file) == model.sha256 ? ModelState::kOk : ModelState::kDamaged;
  } catch (const Error&) {  // cannot be read, or lacks its weights
    return ModelState::kDamaged;
  }
}

}  // namespace deepuav
