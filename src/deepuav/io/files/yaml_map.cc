#include "deepuav/io/files/yaml_map.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/nearest_name.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

constexpr size_t kMaxYamlBytes = size_t{256} << 10;

std::string KindOf(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return Quoted(node.Scalar());
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a mapping";
    default:
      return "empty";
  }
}

}  // namespace

YamlMap YamlMap::Read(const std::filesystem::path& file) {
  std::string bytes = ReadBytes(file, kMaxYamlBytes);
  // OpenCV's way to write a directive, which YAML does not know.
  if (bytes.starts_with("%YAML:")) bytes[0] = '#';
  const std::string name = file.string();
  try {
    return YamlMap(YAML::Load(bytes), name, "");
  } catch (const YAML::Exception& error) {
    const std::string reason = Quoted(error.msg);
    if (error.mark.is_null()) throw Error("{}: is no valid YAML: {}", name, reason);
    throw Error("{}:{}: is no valid YAML: {}", name, error.mark.line + 1, reason);
  }
}

YamlMap::YamlMap(const YAML::Node& node, std::string file, std::string prefix)
    : file_(std::move(file)), prefix_(std::move(prefix)) {
  if (!node.IsMap()) {
    throw Error("{}: {} is {}: expected 'field: value' lines", Where(node),
                prefix_.empty() ? "the file" : prefix_.substr(0, prefix_.size() - 1), KindOf(node));
  }
  for (const auto& entry : node) {
    const YAML::Node& name = entry.first;
    // The name's line, as an empty value has the next one's.
    const std::string where = Where(name);
    if (!name.IsScalar())
      throw Error("{}: a field's name is {}: expected a word", where, KindOf(name));
    if (!fields_.emplace(name.Scalar(), Field{entry.second, where}).second) {
      throw Error("{}: field {} is given twice", where, Quoted(prefix_ + name.Scalar()));
    }
  }
}

std::string YamlMap::Where(const YAML::Node& node) const {
  const YAML::Mark mark = node.Mark();
  return mark.is_null() ? file_ : fmt::format("{}:{}", file_, mark.line + 1);
}

std::string YamlMap::Where(const std::string& key) const {
  const auto found = fields_.find(key);
  return found == fields_.end() ? file_ : found->second.where;
}

const YamlMap::Field& YamlMap::Find(const std::string& key, const char* expected) const {
  const auto found = fields_.find(key);
  if (found == fields_.end()) {
    throw Error("{}: field '{}{}' is missing: expected {}", file_, prefix_, key, expected);
  }
  return found->second;
}

double YamlMap::Number(const std::string& key) const {
  const auto& [value, where] = Find(key, "a number");
  if (!value.IsScalar())
    throw Error("{}: {}{} is {}: expected a number", where, prefix_, key, KindOf(value));
  return ParseFinite(value.Scalar(), where, prefix_ + key);
}

int YamlMap::Integer(const std::string& key, int low, int high) const {
  const double number = Number(key);
  if (number != std::floor(number) || number < low || number > high) {
    throw Error("{}: {}{} is {}: expected a whole number from {} to {}", Where(key), prefix_, key,
                number, low, high);
  }
  return static_cast<int>(number);
}

std::string YamlMap::Text(const std::string& key) const {
  const auto& [value, where] = Find(key, "a word");
  if (!value.IsScalar())
    throw Error("{}: {}{} is {}: expected a word", where, prefix_, key, KindOf(value));
  return value.Scalar();
}

std::vector<double> YamlMap::Numbers(const std::string& key) const {
  const auto& [value, where] = Find(key, "a list of numbers");
  if (!value.IsSequence()) {
    throw Error("{}: {}{} is {}: expected a list of numbers", where, prefix_, key, KindOf(value));
  }
  std::vector<double> numbers;
  for (const YAML::Node& item : value) {
    const std::string field = fmt::format("{}{}[{}]", prefix_, key, numbers.size());
    if (!item.IsScalar())
      throw Error("{}: {} is {}: expected a number", Where(item), field, KindOf(item));
    numbers.push_back(ParseFinite(item.Scalar(), Where(item), field));
  }
  return numbers;
}

std::vector<double> YamlMap::Numbers(const std::string& key, size_t count,
                                     std::string_view expected) const {
  std::vector<double> numbers = Numbers(key);
  if (numbers.size() == count) return numbers;
  throw Error("{}: {} holds {} numbers: expected {}", Where(key), Name(key), numbers.size(),
              expected);
}

YamlMap YamlMap::Map(const std::string& key) const {
  return YamlMap(Find(key, "a mapping").value, file_, prefix_ + key + ".");
}

void YamlMap::RequireKnown(std::span<const std::string> known) const {
  for (const auto& [key, field] : fields_) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    throw Error("{}: unknown field {}: the nearest known one is '{}'", field.where,
                Quoted(prefix_ + key), prefix_ + NearestName(key, known));
  }
}

}  // namespace deepuav
