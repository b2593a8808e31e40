#include "deepuav/io/geodata/gpx_file.h"

#include <algorithm>
#include <pugixml.hpp>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"
#include "deepuav/io/geodata/iso_time.h"

namespace deepuav {
namespace {

constexpr size_t kMaxGpxBytes = size_t{256} << 20;

/// An element's name without the prefix of its namespace.
std::string_view LocalName(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  const size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

class TrackPoints : public pugi::xml_tree_walker {
 public:
  TrackPoints(std::string name, std::string_view bytes,
              const std::function<void(const GnssFix&, const std::string&)>& take)
      : name_(std::move(name)), bytes_(bytes), take_(take) {}

  bool for_each(pugi::xml_node& node) override {
    if (LocalName(node) == "trkpt") take_(Read(node), Where(node));
    return true;
  }

 private:
  std::string Where(const pugi::xml_node& node) {
    const auto end = std::min(static_cast<size_t>(node.offset_debug()), bytes_.size());
    if (end > counted_) {
      line_ += std::count(bytes_.begin() + static_cast<std::ptrdiff_t>(counted_),
                          bytes_.begin() + static_cast<std::ptrdiff_t>(end), '\n');
      counted_ = end;
    }
    return fmt::format("{}:{}", name_, line_);
  }

  GnssFix Read(const pugi::xml_node& point) {
    const std::string where = Where(point);
    GnssFix fix;
    fix.latitude_deg = ParseFinite(point.attribute("lat").value(), where, "lat");
    fix.longitude_deg = ParseFinite(point.attribute("lon").value(), where, "lon");
    bool has_time = false;
    for (const pugi::xml_node& child : point.children()) {
      const std::string text = child.text().get();
      if (LocalName(child) == "ele") {
        fix.altitude_m = ParseFinite(text, where, "ele");
      } else if (LocalName(child) == "time") {
        fix.time = ParseIsoTime(text, where);
        has_time = true;
      }
    }
    if (!has_time) throw Error("{}: the track point has no time: expected one", where);
    return fix;
  }

  std::string name_;
  std::string_view bytes_;
  const std::function<void(const GnssFix&, const std::string&)>& take_;
  size_t counted_ = 0;
  int64_t line_ = 1;
};

}  // namespace

void VisitGpxPoints(const std::filesystem::path& file,
                    const std::function<void(const GnssFix&, const std::string&)>& take) {
  const std::string bytes = ReadBytes(file, kMaxGpxBytes);
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(
      bytes.data(), bytes.size(), pugi::parse_default | pugi::parse_trim_pcdata);
  if (!parsed) {
    const auto end =
        bytes.begin() + std::min(static_cast<std::ptrdiff_t>(bytes.size()), parsed.offset);
    throw Error("{}:{}: is no XML: {}: expected GPX", file.string(),
                1 + std::count(bytes.begin(), end, '\n'), parsed.description());
  }
  TrackPoints points(file.string(), bytes, take);
  document.traverse(points);
}

}  // namespace deepuav
