#include "deepuav/viewer/access_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <random>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr std::string_view kScheme = "http://";

}  // namespace

bool IsOurHost(std::string_view host, const AccessRules& rules) {
  const std::string port = fmt::format(":{}", rules.port);
  if (!host.ends_with(port)) return false;
  host.remove_suffix(port.size());
  return std::find(rules.hosts.begin(), rules.hosts.end(), host) != rules.hosts.end();
}

bool IsOurOrigin(std::string_view origin, std::string_view host) {
  return origin.starts_with(kScheme) && origin.substr(kScheme.size()) == host;
}

bool IsToken(std::string_view given, const AccessRules& rules) {
  if (rules.token.empty()) return true;
  unsigned differs = given.size() == rules.token.size() ? 0 : 1;
  for (size_t i = 0; i < rules.token.size(); ++i) {
    const char letter = i < given.size() ? given[i] : '\0';
    differs |= static_cast<unsigned char>(letter) ^ static_cast<unsigned char>(rules.token[i]);
  }
  return differs == 0;
}

std::string_view CookieValue(std::string_view cookies, std::string_view name) {
  while (!cookies.empty()) {
    std::string_view cookie = cookies.substr(0, cookies.find(';'));
    cookies.remove_prefix(std::min(cookie.size() + 1, cookies.size()));
    while (cookie.starts_with(' ')) cookie.remove_prefix(1);
    if (cookie.starts_with(name) && cookie.substr(name.size()).starts_with('='))
      return cookie.substr(name.size() + 1);
  }
  return {};
}

Target SplitTarget(std::string_view target) {
  constexpr std::string_view kToken = "token=";
  const size_t query = std::min(target.find('?'), target.size());
  Target split{target.substr(0, query), {}};
  std::string_view rest = target.substr(std::min(query + 1, target.size()));
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    if (part.starts_with(kToken)) split.token = part.substr(kToken.size());
  }
  return split;
}

std::string NewToken() {
  std::random_device system;
  std::string token;
  constexpr int kWords = 4;
  for (int i = 0; i < kWords; ++i) token += fmt::format("{:08x}", system());
  return token;
}

bool IsLoopback(const std::string& address) {
  boost::system::error_code problem;
  const auto parsed = boost::asio::ip::make_address(address, problem);
  if (problem) throw Error("address '{}': expected one as 127.0.0.1, 0.0.0.0 or ::1", address);
  return parsed.is_loopback();
}

}  // namespace deepuav
