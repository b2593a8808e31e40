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

/// Nothing where the line does not name image, latitude and longitude. Of several columns that may
/// name the image, the one that does in `row`.
std::optional<Columns> ColumnsOfHead(std::string_view line, std::string_view row = {}) {
  TableRow names, values;
  SplitRow(line, &names);
  SplitRow(row, &values);
  std::optional<size_t> image;
  Columns columns;
  const auto is_named = [&](size_t i) {
    return i < values.size() && IsImageFileName(fs::path(values[i]));
  };
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string name = LowerCase(names[i]);
    if (columns.fix.Take(name, i) || !NamesImage(name)) continue;
    if (!image || (is_named(i) && !is_named(*image))) image = i;
  }
  if (!image || !columns.fix.are_complete()) return std::nullopt;
  columns.image = *image;
  return columns;
}

bool IsRow(const TableRow& fields) {
  const auto is_number = [](std::string_view field) {
    double number = 0;
    return IsNumber(field, &number) || HasDecimalComma(field);
  };
  return fields.size() >= kFewestFields && IsImageFileName(fs::path(fields[0])) &&
         is_number(fields[1]) && is_number(fields[2]);
}

std::optional<HeadLine> TableHead(const std::vector<HeadLine>& lines) {
  for (const HeadLine& line : lines) {
    if (ColumnsOfHead(line.text)) return line;
  }
  return std::nullopt;
}

enum class Layout { kNone, kHead, kNoHead, kReferenceSystem };

/// What is not in a head of names is judged by what TextFile gives: comments are none of it.
Layout LayoutOf(const std::vector<HeadLine>& lines) {
  if (TableHead(lines)) return Layout::kHead;
  std::vector<std::string_view> rows;
  for (const HeadLine& line : lines) {
    if (!line.is_comment) rows.push_back(line.text);
  }
  if (rows.empty()) return Layout::kNone;
  TableRow fields;
  SplitRow(rows[0], &fields);
  if (IsRow(fields)) return Layout::kNoHead;
  if (rows.size() < 2 || !NamesReferenceSystem(rows[0])) return Layout::kNone;
  SplitAtBlanks(rows[1], &fields);
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

std::vector<Geotag> ReadTable(const fs::path& file, const std::optional<HeadLine>& head) {
  const TextFile text(file);
  std::optional<Columns> columns;
  Tags tags;
  TableRow fields;
  for (size_t i = head ? FirstRow(text, *head) : 0; i < text.lines().size(); ++i) {
    const TextLine& line = text.lines()[i];
    const std::string where = text.Where(line);
    ReadRow(line.text, &fields, where);
    if (!columns) {
      columns = head ? ColumnsOfHead(head->text, line.text)
                     : Columns{0, FixColumns::ByPlace(fields.size())};
      if (head) columns->fix.CheckHead(head->text, file.string());
    }
    CheckFieldCount(fields, 1 + std::max(columns->image, columns->fix.last_needed()),
                    "image and its position", where);
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
    CheckFieldCount(fields, kFewestFields, "image and its position", where);
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

bool IsTextTable(const fs::directory_entry& entry) {
  const std::string ending = LowerCase(entry.path().extension().string());
  std::error_code unreadable;
  return (ending == ".csv" || ending == ".txt") && entry.is_regular_file(unreadable);
}

bool IsReadableGeotagFile(const fs::path& file) {
  try {
    return IsGeotagFile(file);
  } catch (const Error& error) {
    Log().warn("not looked at: {}", error.what());
    return false;
  }
}

}  // namespace

bool IsGeotagFile(const fs::path& file) { return LayoutOf(FirstLines(file)) != Layout::kNone; }

std::vector<Geotag> ReadGeotagFile(const fs::path& file) {
  const std::vector<HeadLine> head = FirstLines(file);
  const Layout layout = LayoutOf(head);
  std::vector<Geotag> tags;
  if (layout != Layout::kNone)
    tags = layout == Layout::kReferenceSystem ? ReadGridList(TextFile(file))
                                              : ReadTable(file, TableHead(head));
  if (tags.empty()) throw Error("{}: lists no position of an image", file.string());
  return tags;
}

std::vector<fs::path> FindGeotagsBeside(const std::vector<fs::path>& folders) {
  std::vector<fs::path> found;
  for (const fs::path& folder : folders) {
    std::vector<fs::path> here;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (IsTextTable(entry) && IsReadableGeotagFile(entry.path())) here.push_back(entry.path());
    }
    std::ranges::sort(here);
    for (const fs::path& file : here) {
      if (std::ranges::find(found, file) == found.end()) found.push_back(file);
    }
  }
  return found;
}

}  // namespace deepuav
