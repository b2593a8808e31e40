#include "deepuav/autopilot/link_address.h"

#include <charconv>

#include "deepuav/base/error.h"

namespace deepuav {

LinkAddress ParseLinkAddress(const std::string& text) {
  constexpr int kMostPort = 65535;
  const auto wrong = [&text]() -> Error {
    return Error("address '{}': expected udp:HOST:PORT, as udp:127.0.0.1:14580", text);
  };
  const std::string scheme = "udp:";
  const size_t colon = text.rfind(':');
  if (!text.starts_with(scheme) || colon < scheme.size()) throw wrong();
  LinkAddress address;
  address.host = text.substr(scheme.size(), colon - scheme.size());
  if (address.host.starts_with('[') && address.host.ends_with(']'))
    address.host = address.host.substr(1, address.host.size() - 2);
  const char* const end = text.data() + text.size();
  const auto [next, problem] = std::from_chars(text.data() + colon + 1, end, address.port);
  if (problem != std::errc() || next != end || address.host.empty()) throw wrong();
  if (address.port < 1 || address.port > kMostPort) throw wrong();
  return address;
}

}  // namespace deepuav
