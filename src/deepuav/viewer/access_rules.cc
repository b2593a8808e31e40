#include "deepuav/viewer/access_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <cctype>
#include <charconv>
#include <optional>
#include <random>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

namespace ip = boost::asio::ip;

constexpr std::string_view kScheme = "http://";
constexpr uint16_t kHttpPort = 80;  // Browsers leave it out.

/// Takes the port off the Host; nothing where it is no number.
std::optional<uint16_t> TakePort(std::string_view* host) {
  const size_t colon = host->rfind(':');
  if (colon == std::string_view::npos || host->ends_with(']')) return kHttpPort;
  const std::string_view digits = host->substr(colon + 1);
  host->remove_suffix(digits.size() + 1);
  uint16_t port = 0;
  const char* const end = digits.data() + digits.size();
  const auto [read, problem] = std::from_chars(digits.data(), end, port);
  if (problem != std::errc() || read != end) return std::nullopt;
  return port;
}

/// The IP address that a Host without its port is; nothing where it is a name.
std::optional<ip::address> AddressOf(std::string_view host) {
  // What is repeated in the answer holds nothing else, as an interface's name after the address.
  if (host.find_first_not_of("[]:.0123456789abcdefABCDEF") != std::string_view::npos)
    return std::nullopt;
  boost::system::error_code problem;
  ip::address address;
  if (host.starts_with('[') && host.ends_with(']')) {
    address = ip::make_address_v6(std::string(host.substr(1, host.size() - 2)), problem);
  } else {
    address = ip::make_address_v4(std::string(host), problem);
  }
  return problem ? std::nullopt : std::make_optional(address);
}

bool IsSameName(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

}  // namespace

bool IsOurHost(std::string_view host, const AccessRules& rules) {
  const std::optional<uint16_t> port = TakePort(&host);
  if (!port) return false;
  const std::optional<ip::address> address = AddressOf(host);
  if (IsSameName(host, "localhost") || (address && address->is_loopback())) return true;
  if (*port != rules.port) return false;
  if (address && rules.any_address) return true;
  return std::any_of(rules.hosts.begin(), rules.hosts.end(),
                     [&](const std::string& own) { return IsSameName(host, own); });
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
  const auto parsed = ip::make_address(address, problem);
  if (problem) throw Error("address '{}': expected one as 127.0.0.1, 0.0.0.0 or ::1", address);
  return parsed.is_loopback();
}

}  // namespace deepuav
