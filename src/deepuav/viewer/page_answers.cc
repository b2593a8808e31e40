#include "deepuav/viewer/page_answers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "deepuav/evaluation/page_files.h"
#include "deepuav/viewer/view_files.h"

namespace deepuav {
namespace {

struct Route {
  std::string_view path;
  std::string_view (*file)(std::string_view);
  std::string_view name;
  std::string_view type;
};

constexpr std::string_view kHtml = "text/html; charset=utf-8", kCss = "text/css; charset=utf-8",
                           kScript = "text/javascript; charset=utf-8",
                           kText = "text/plain; charset=utf-8";

// Paths are compared as they stand: no path leads to a file system.
constexpr std::array kRoutes = {
    Route{"/", ViewFile, "view.html", kHtml},
    Route{"/view.css", ViewFile, "view.css", kCss},
    Route{"/view.js", ViewFile, "view.js", kScript},
    Route{"/messages.js", ViewFile, "messages.js", kScript},
    Route{"/live_charts.js", ViewFile, "live_charts.js", kScript},
    Route{"/report.css", PageFile, "report.css", kCss},
    Route{"/unpack.js", PageFile, "unpack.js", kScript},
    Route{"/colors.js", PageFile, "colors.js", kScript},
    Route{"/scene.js", PageFile, "scene.js", kScript},
    Route{"/charts.js", PageFile, "charts.js", kScript},
    Route{"/licences.txt", PageFile, "licences.txt", kText},
    Route{"/three.min.js", PageFile, "three.min.js", kScript},
    Route{"/OrbitControls.js", PageFile, "OrbitControls.js", kScript},
    Route{"/LineSegmentsGeometry.js", PageFile, "LineSegmentsGeometry.js", kScript},
    Route{"/LineGeometry.js", PageFile, "LineGeometry.js", kScript},
    Route{"/LineMaterial.js", PageFile, "LineMaterial.js", kScript},
    Route{"/LineSegments2.js", PageFile, "LineSegments2.js", kScript},
    Route{"/Line2.js", PageFile, "Line2.js", kScript},
    Route{"/chart.min.js", PageFile, "chart.min.js", kScript},
};

}  // namespace

PageAnswer Refusal(int status, std::string_view why) {
  PageAnswer answer;
  answer.status = status;
  answer.body = why;
  return answer;
}

std::string CookieName(const AccessRules& rules) {
  return fmt::format("deepuav_view_{}", rules.port);
}

bool MaySee(const PageRequest& request, const AccessRules& rules, PageAnswer* refusal) {
  if (!IsOurHost(request.host, rules)) {
    *refusal = Refusal(421, "This server has another name.\n");
    return false;
  }
  if (!request.origin.empty() && !IsOurOrigin(request.origin, request.host)) {
    *refusal = Refusal(403, "Only its own page may ask.\n");
    return false;
  }
  const std::string_view cookie = CookieValue(request.cookies, CookieName(rules));
  if (IsToken(cookie, rules) || IsToken(SplitTarget(request.target).token, rules)) return true;
  *refusal = Refusal(403, "Open the address with the token that the program printed.\n");
  return false;
}

PageAnswer AnswerPage(const PageRequest& request, const AccessRules& rules) {
  PageAnswer answer;
  if (!request.is_get) return Refusal(405, "Only GET is answered.\n");
  if (!MaySee(request, rules, &answer)) return answer;
  const Target target = SplitTarget(request.target);
  const auto route = std::find_if(kRoutes.begin(), kRoutes.end(),
                                  [&](const Route& one) { return one.path == target.path; });
  if (route == kRoutes.end()) return Refusal(404, "There is nothing here.\n");
  if (!target.token.empty()) {
    // From then on the cookie has it, and it stands in no history of pages.
    answer.status = 303;
    answer.location = std::string(route->path);
    if (!rules.token.empty())
      answer.cookie =
          fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict", CookieName(rules), rules.token);
    return answer;
  }
  answer.type = route->type;
  answer.body = route->file(route->name);
  return answer;
}

}  // namespace deepuav
