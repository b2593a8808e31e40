#include "deepuav/evaluation/report/report_page.h"

#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/evaluation/page_files.h"

namespace deepuav {
namespace {

constexpr std::string_view kSlotStart = "<!--{", kSlotEnd = "}-->";
constexpr std::string_view kDataSlot = "data";

/// Text between script tags must not close them; within JSON and JavaScript strings "\/" is "/".
std::string WithoutClosingTag(std::string_view script) {
  std::string safe;
  safe.reserve(script.size());
  for (size_t i = 0; i < script.size(); ++i) {
    safe += script[i];
    if (script[i] == '<' && i + 1 < script.size() && script[i + 1] == '/') safe += '\\';
  }
  return safe;
}

/// JSON that can stand in a script element: an escaped '<' opens neither tag nor comment.
std::string EmbeddedJson(const nlohmann::ordered_json& json) {
  const std::string text =
      json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char letter : text) {
    if (letter == '<') {
      safe += "\\u003c";
    } else {
      safe += letter;
    }
  }
  return safe;
}

std::string SlotContent(std::string_view slot, const nlohmann::ordered_json& data) {
  if (slot == kDataSlot) return EmbeddedJson(data);
  const std::string_view file = PageFile(slot);
  return slot.ends_with(".js") ? WithoutClosingTag(file) : std::string(file);
}

}  // namespace

void ReportPageOptions::Check() const { CheckOptions("", *this); }

std::string ReportPage(const std::vector<RunReport>& reports, const std::string& version,
                       const ReportPageOptions& options) {
  options.Check();
  if (reports.empty()) throw Error("There is no run to report on");
  nlohmann::ordered_json data = {{"version", version}, {"runs", nlohmann::ordered_json::array()}};
  for (const RunReport& report : reports) {
    data["runs"].push_back(RunReportJson(report, options.max_points));
  }
  std::string page;
  std::string_view rest = PageFile("report.html");
  for (size_t at = rest.find(kSlotStart); at != std::string_view::npos;
       at = rest.find(kSlotStart)) {
    page += rest.substr(0, at);
    rest.remove_prefix(at + kSlotStart.size());
    const size_t end = rest.find(kSlotEnd);
    page += SlotContent(rest.substr(0, end), data);
    rest.remove_prefix(end + kSlotEnd.size());
  }
  return page.append(rest);
}

}  // namespace deepuav
