#include "deepuav/io/files/options_file.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/files/yaml_map.h"

namespace deepuav {
namespace {

// Aliases can make a small file nest without end, and sections that do not exist as wide as they
// like.
constexpr int kMaxDepth = 16;
constexpr size_t kIndent = 2;

class Loader {
 public:
  explicit Loader(OptionRegistry* options) : options_(options) {}

  void Load(const YamlMap& map, const std::string& prefix, int depth) {
    for (const auto& [key, field] : map.fields()) {
      const YAML::Node& value = field.value;
      const std::string name = prefix + key;
      if (value.IsMap()) {
        if (depth == kMaxDepth) throw Error("{}: {} nests too deep", field.where, Quoted(name));
        if (!IsSection(name)) {
          throw Error("{}: no options begin with {}: expected a section of options", field.where,
                      Quoted(name));
        }
        Load(YamlMap(value, map.file(), name + "."), name + ".", depth + 1);
      } else if (value.IsScalar()) {
        Set(name, value.Scalar(), field.where);
      } else if (!value.IsNull() || !IsSection(name)) {  // a section may be empty
        throw Error("{}: option {} is {}: expected a value", field.where, Quoted(name),
                    value.IsNull() ? "empty" : "a list");
      }
    }
  }

 private:
  void Set(const std::string& name, const std::string& text, const std::string& where) {
    if (!seen_.insert(name).second) {
      throw Error("{}: option {} is given twice", where, Quoted(name));
    }
    try {
      options_->Set(name, text);
    } catch (const Error& error) {
      throw Error("{}: {}", where, OneLine(error.what()));
    }
  }

  bool IsSection(const std::string& name) const {
    const auto next = options_->entries().lower_bound(name + ".");
    return next != options_->entries().end() && next->first.starts_with(name + ".");
  }

  OptionRegistry* options_;
  std::set<std::string> seen_;
};

// As it stands where YAML reads it back as the same text, else in double quotes.
std::string YamlScalar(const std::string& text) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./+-";
  const bool is_plain = !text.empty() && text.find_first_not_of(kPlain) == std::string::npos &&
                        !text.starts_with('-') && text != "null" && text != "Null" &&
                        text != "NULL";
  double ignored = 0;
  if (is_plain || IsNumber(text, &ignored)) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (code < 0x20 || code == 0x7f) {
      quoted += fmt::format("\\x{:02x}", code);
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::vector<std::string> SplitAtDots(const std::string& name) {
  std::vector<std::string> parts;
  for (size_t start = 0; start <= name.size();) {
    const size_t end = std::min(name.find('.', start), name.size());
    parts.push_back(name.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

}  // namespace

void LoadOptionsFile(const std::filesystem::path& file, OptionRegistry* options) {
  Loader(options).Load(YamlMap::Read(file), "", 0);
}

std::string OptionsAsYaml(const OptionRegistry& options) {
  std::string yaml;
  std::vector<std::string> open;  // the sections that the last line stands in
  for (const auto& [name, entry] : options.entries()) {
    std::vector<std::string> parts = SplitAtDots(name);
    const std::string leaf = parts.back();
    parts.pop_back();
    const auto [differs, unused] =
        std::mismatch(parts.begin(), parts.end(), open.begin(), open.end());
    for (auto section = differs; section != parts.end(); ++section) {
      const auto depth = static_cast<size_t>(section - parts.begin());
      yaml += fmt::format("{:{}}{}:\n", "", kIndent * depth, *section);
    }
    open = parts;
    const std::string unit = entry.unit.empty() ? "" : fmt::format("[{}] ", entry.unit);
    const std::string bounds = entry.bounds.empty() ? "" : fmt::format(" ({})", entry.bounds);
    yaml += fmt::format("{:{}}{}: {}  # {}{}{}\n", "", kIndent * parts.size(), leaf,
                        YamlScalar(entry.get()), unit, OneLine(entry.meaning), bounds);
  }
  return yaml;
}

}  // namespace deepuav
