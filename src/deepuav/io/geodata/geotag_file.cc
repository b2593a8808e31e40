#include "deepuav/io/geodata/geotag_file.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/datasets/image_file_dataset.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/fix_table.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/geodata/grid_coordinates.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr size_t kFewestFields = 3;  // Image and two coordinates.

struct Columns {
  size_t image = 0;
  FixColumns fix;
};

bool NamesImage(const std::string& column) {
  constexpr std::array<std::string_view, 6> kNames = {"image", "file", "photo",
                                                      "label", "name", "picture"};
  return std::ranges::any_of(
      kNames, [&](std::string_view name) { return column.find(name) != std::string::npos; });
}

/// Nothing where the line does not name image, latitude and longitude.
std::optional<Columns> ColumnsOfHead(std::string_view line) {
  TableRow names;
  SplitRow(line, &names);
  std::optional<size_t> image;
  Columns columns;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string name = LowerCase(names[i]);
    if (!columns.fix.Take(name, i) && !image && NamesImage(name)) image = i;
  }
  if (!image || !columns.fix.are_complete()) return std::nullopt;
  columns.image = *image;
  return columns;
}

bool IsRow(const TableRow& fields) {
  double number = 0;
  return fields.size() >= kFewestFields && IsImageFileName(fs::path(fields[0])) &&
         IsNumber(fields[1], &number) && IsNumber(fields[2], &number);
}

/// Of a table without a head, by how many fields its first row has.
Columns ColumnsByPlace(size_t count) {
  Columns columns;
  columns.fix.latitude = 1;
  columns.fix.longitude = 2;
  if (count > kFewestFields) columns.fix.altitude = kFewestFields;
  return columns;
}

/// The first lines of a file, comments too, as heads are often written as these.
std::vector<std::string> FirstLines(const fs::path& file) {
  constexpr size_t kHeadBytes = 8192, kMostLines = 10;
  constexpr std::string_view kBlank = " \t\r#\xEF\xBB\xBF";
  const std::string head = ReadHead(file, kHeadBytes);
  std::string_view rest = head;
  std::vector<std::string> lines;
  while (!rest.empty() && lines.size() < kMostLines) {
    const size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
    line = line.substr(0, line.find_last_not_of(kBlank) + 1);
    if (!line.empty()) lines.emplace_back(line);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return lines;
}

enum class Layout { kNone, kHead, kNoHead, kReferenceSystem };

Layout LayoutOf(const std::vector<std::string>& lines) {
  if (lines.empty()) return Layout::kNone;
  if (std::ranges::any_of(lines, [](const auto& line) { return ColumnsOfHead(line).has_value(); }))
    return Layout::kHead;
  TableRow fields;
  SplitRow(lines[0], &fields);
  if (IsRow(fields)) return Layout::kNoHead;
  if (lines.size() < 2 || !NamesReferenceSystem(lines[0])) return Layout::kNone;
  SplitAtBlanks(lines[1], &fields);
  return IsRow(fields) ? Layout::kReferenceSystem : Layout::kNone;
}

/// The fields of OpenDroneMap's geo.txt.
struct GridColumns {
  FixColumns fix{.latitude = 2, .longitude = 1, .altitude = {}, .sigma = {}};

  explicit GridColumns(size_t count) {
    constexpr size_t kAltitude = 3, kHorizontal = 7, kVertical = 8;
    if (count > kAltitude) fix.altitude = kAltitude;
    if (count > kHorizontal) fix.sigma[0] = fix.sigma[1] = kHorizontal;
    if (count > kVertical) fix.sigma[2] = kVertical;
  }
};

class Tags {
 public:
  void Add(std::string_view image, const std::optional<GnssFix>& fix, const std::string& where) {
    if (!fix || (fix->latitude_deg == 0 && fix->longitude_deg == 0)) return;
    CheckOnGlobe(*fix, where);
    tags_.push_back({std::string(image), *fix});
  }
  std::vector<Geotag> Take() { return std::move(tags_); }

 private:
  std::vector<Geotag> tags_;
};

void CheckCount(const TableRow& fields, size_t needed, const std::string& where) {
  if (fields.size() >= needed) return;
  throw Error("{}: {} fields: expected at least {} (image and its position)", where, fields.size(),
              needed);
}

std::vector<Geotag> ReadTable(const TextFile& text, const std::vector<std::string>& head) {
  const auto named = std::ranges::find_if(
      head, [](const std::string& line) { return ColumnsOfHead(line).has_value(); });
  std::optional<Columns> columns;
  if (named != head.end()) columns = ColumnsOfHead(*named);
  Tags tags;
  TableRow fields;
  for (const TextLine& line : text.lines()) {
    if (columns && line.text == *named) continue;
    const std::string where = text.Where(line);
    SplitRow(line.text, &fields);
    if (!columns) columns = ColumnsByPlace(fields.size());
    CheckCount(fields, 1 + std::max(columns->image, columns->fix.last_needed()), where);
    tags.Add(fields[columns->image], ParseFix(fields, columns->fix, where), where);
  }
  return tags.Take();
}

std::vector<Geotag> ReadGridList(const TextFile& text) {
  Tags tags;
  TableRow fields;
  std::optional<GridCoordinates> grid;
  for (const TextLine& line : text.lines()) {
    const std::string where = text.Where(line);
    if (!grid) {
      grid.emplace(line.text, where);
      continue;
    }
    SplitAtBlanks(line.text, &fields);
    CheckCount(fields, kFewestFields, where);
    std::optional<GnssFix> fix = ParseFix(fields, GridColumns(fields.size()).fix, where);
    if (fix) {
      const Eigen::Vector2d place =
          grid->LatitudeLongitude(fix->longitude_deg, fix->latitude_deg, where);
      fix->latitude_deg = place.x();
      fix->longitude_deg = place.y();
    }
    tags.Add(fields[0], fix, where);
  }
  return tags.Take();
}

bool IsTextTable(const fs::path& file) {
  const std::string ending = LowerCase(file.extension().string());
  return (ending == ".csv" || ending == ".txt") && fs::is_regular_file(file);
}

}  // namespace

bool IsGeotagFile(const fs::path& file) { return LayoutOf(FirstLines(file)) != Layout::kNone; }

std::vector<Geotag> ReadGeotagFile(const fs::path& file) {
  const std::vector<std::string> head = FirstLines(file);
  const Layout layout = LayoutOf(head);
  const TextFile text(file);
  std::vector<Geotag> tags;
  if (layout != Layout::kNone)
    tags = layout == Layout::kReferenceSystem ? ReadGridList(text) : ReadTable(text, head);
  if (tags.empty()) throw Error("{}: lists no position of an image", file.string());
  return tags;
}

fs::path FindGeotagsBeside(const std::vector<fs::path>& folders) {
  std::vector<fs::path> found;
  for (const fs::path& folder : folders) {
    std::vector<fs::path> here;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (IsTextTable(entry.path()) && IsGeotagFile(entry.path())) here.push_back(entry.path());
    }
    std::ranges::sort(here);
    for (const fs::path& file : here) {
      if (std::ranges::find(found, file) == found.end()) found.push_back(file);
    }
  }
  if (found.empty()) return {};
  for (size_t i = 1; i < found.size(); ++i) {
    Log().warn("{}: not used: {} lists positions of the images, too", found[i].string(),
               found[0].string());
  }
  return found[0];
}

}  // namespace deepuav
