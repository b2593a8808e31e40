#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace deepuav {

/// Who may see the page.
struct AccessRules {
  std::vector<std::string> hosts;  ///< Names and addresses that requests may name as Host.
  uint16_t port = 0;
  std::string token;  ///< Empty: none is needed.
  /// Whether they may name any IP address: this machine may get others while it listens at all.
  bool any_address = false;
};

/// Whether a request's Host names this server: else a page of someone else's name that leads here
/// could read what is shown. No one else can have a name of the loopback, at whatever port it is
/// forwarded to, or an IP address for a name.
bool IsOurHost(std::string_view host, const AccessRules& rules);

/// Whether the Origin is the page that this Host gives.
bool IsOurOrigin(std::string_view origin, std::string_view host);

/// Whether the token is the one, in a time that does not depend on how much of it is right.
bool IsToken(std::string_view given, const AccessRules& rules);

/// The value of the cookie; empty without it.
std::string_view CookieValue(std::string_view cookies, std::string_view name);

/// The target's path, and the value of `token` in its query, or empty.
struct Target {
  std::string_view path, token;
};
Target SplitTarget(std::string_view target);

/// 128 bits from the system, as hexadecimal digits.
std::string NewToken();

/// Whether it is an address of this machine that no other reaches. Throws Error for what is no
/// address.
bool IsLoopback(const std::string& address);

}  // namespace deepuav
