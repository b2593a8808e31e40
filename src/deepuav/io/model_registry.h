#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace deepuav {

/// One entry of a folder's models.yaml.
struct ShippedModel {
  std::string name;
  std::string kind;            ///< superpoint, superglue or vocabulary.
  std::string size;            ///< As in --features; empty where a kind has one size.
  std::string precision;       ///< fp32 (also run in bf16) or int8; empty for vocabularies.
  std::filesystem::path file;  ///< With the folder.
  std::string sha256;          ///< ModelSha256 of the file, as it should be.
  std::string licence;
  std::filesystem::path card;  ///< With the folder.
};

enum class ModelState { kOk, kDamaged, kMissing };

/// A file that is about to be loaded.
struct CheckedModel {
  std::string name;  ///< Of the shipped model; empty for any other file.
  std::filesystem::path file;
  std::string sha256;
};

/// What a folder of models is said to hold. Const use is thread-safe.
class ModelRegistry {
 public:
  /// Reads the folder's models.yaml, not the models. Throws Error naming file and line.
  explicit ModelRegistry(const std::filesystem::path& folder);

  /// By name.
  const std::vector<ShippedModel>& models() const { return models_; }

  /// The network of that kind and size that inference runs with `precision` (auto, fp32, bf16 or
  /// int8): for auto the quantised one, where there is one and `int8_is_fast`. Throws Error saying
  /// which there are.
  const ShippedModel& Network(const std::string& kind, const std::string& size,
                              const std::string& precision, bool int8_is_fast) const;

  /// Nothing where none is shipped.
  const ShippedModel* Vocabulary() const;

  bool HasKind(const std::string& kind) const;
  /// Whether the file is a shipped model's, whole or not.
  bool Ships(const std::filesystem::path& file) const { return FindFile(file) != nullptr; }

  /// The file's SHA-256. Throws Error where the file is missing, and naming the file, the found and
  /// the expected hash where it is a shipped model's but not as shipped.
  CheckedModel Check(const std::filesystem::path& file) const;

  /// What Check would find.
  static ModelState StateOf(const ShippedModel& model);

 private:
  const ShippedModel* FindFile(const std::filesystem::path& file) const;
  std::string Describe(const std::string& kind) const;

  std::filesystem::path folder_;
  std::vector<ShippedModel> models_;
};

}  // namespace deepuav
