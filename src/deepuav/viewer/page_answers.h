#pragma once

#include <string>
#include <string_view>

#include "deepuav/viewer/access_rules.h"

namespace deepuav {

/// What a request asks, as far as the page needs it.
struct PageRequest {
  bool is_get = false;
  std::string_view target, host, origin, cookies;
};

/// What it is answered.
struct PageAnswer {
  int status = 200;
  std::string_view type = "text/plain; charset=utf-8";
  std::string_view body;         ///< Lives as long as the program.
  std::string cookie, location;  ///< Headers of these names where not empty.
};

/// An answer that only says why there is none; `why` must live as long as the program.
PageAnswer Refusal(int status, std::string_view why);

/// Where the page asks for its messages by WebSocket.
inline constexpr std::string_view kMessagesPath = "/messages";

/// The name of the cookie that holds the token: cookies know no ports.
std::string CookieName(const AccessRules& rules);

/// Whether the request may see anything; else `refusal` says why not.
bool MaySee(const PageRequest& request, const AccessRules& rules, PageAnswer* refusal);

/// A file of the page, and nothing else there is.
PageAnswer AnswerPage(const PageRequest& request, const AccessRules& rules);

}  // namespace deepuav
