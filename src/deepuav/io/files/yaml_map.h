#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace deepuav {

/// A mapping in a YAML file, whose every error names file, line and field. Keys are unique.
class YamlMap {
 public:
  /// Throws Error when the file cannot be read, is no YAML or no mapping.
  static YamlMap Read(const std::filesystem::path& file);

  struct Field {
    YAML::Node value;
    std::string where;  ///< "file:line"
  };
  const std::map<std::string, Field>& fields() const { return fields_; }
  const std::string& file() const { return file_; }

  bool Has(const std::string& key) const { return fields_.contains(key); }
  /// Each throws Error where the field is missing or not of that kind; numbers are finite.
  double Number(const std::string& key) const;
  int Integer(const std::string& key, int low, int high) const;
  std::string Text(const std::string& key) const;
  std::vector<double> Numbers(const std::string& key) const;
  /// `count` of them; `expected` says which.
  std::vector<double> Numbers(const std::string& key, size_t count,
                              std::string_view expected) const;
  YamlMap Map(const std::string& key) const;

  /// Throws Error for a key that is not `known`, naming the nearest one.
  void RequireKnown(std::span<const std::string> known) const;

  /// The field's name from the top of the file: "T_BS.data".
  std::string Name(const std::string& key) const { return prefix_ + key; }
  /// "file:line" of the field, or "file" where it is missing.
  std::string Where(const std::string& key) const;

  /// The mapping of `node`; `prefix` is put before its keys in messages ("T_BS.").
  YamlMap(const YAML::Node& node, std::string file, std::string prefix);

 private:
  const Field& Find(const std::string& key, const char* expected) const;
  std::string Where(const YAML::Node& node) const;

  std::string file_, prefix_;
  std::map<std::string, Field> fields_;
};

}  // namespace deepuav
