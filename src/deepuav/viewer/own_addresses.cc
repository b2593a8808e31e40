#include "deepuav/viewer/own_addresses.h"

#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <unistd.h>

#include <array>
#include <boost/asio/ip/address.hpp>
#include <cstring>
#include <optional>

namespace deepuav {
namespace {

namespace ip = boost::asio::ip;

std::string AsHost(const ip::address& address) {
  return address.is_v6() ? fmt::format("[{}]", address.to_string()) : address.to_string();
}

std::optional<ip::address> AddressOf(const ifaddrs& entry) {
  if (!entry.ifa_addr) return std::nullopt;
  if (entry.ifa_addr->sa_family == AF_INET) {
    sockaddr_in found{};
    std::memcpy(&found, entry.ifa_addr, sizeof(found));
    return ip::address_v4(ntohl(found.sin_addr.s_addr));
  }
  if (entry.ifa_addr->sa_family != AF_INET6) return std::nullopt;
  sockaddr_in6 found{};
  std::memcpy(&found, entry.ifa_addr, sizeof(found));
  ip::address_v6::bytes_type bytes{};
  std::memcpy(bytes.data(), &found.sin6_addr, bytes.size());
  const ip::address_v6 address(bytes);
  // Those that hold on one interface only are taken by no browser.
  if (address.is_link_local()) return std::nullopt;
  return address;
}

/// The first address that others reach; of the old kind, where there is one.
std::optional<ip::address> FirstForOthers(bool may_be_v6) {
  ifaddrs* interfaces = nullptr;
  if (::getifaddrs(&interfaces) != 0) return std::nullopt;
  std::optional<ip::address> first;
  for (const ifaddrs* entry = interfaces; entry; entry = entry->ifa_next) {
    const std::optional<ip::address> address = AddressOf(*entry);
    if (!address || address->is_loopback() || (address->is_v6() && !may_be_v6)) continue;
    if (!first || (first->is_v6() && address->is_v4())) first = address;
  }
  ::freeifaddrs(interfaces);
  return first;
}

}  // namespace

std::vector<std::string> OwnHosts(const std::string& address) {
  const ip::address listening = ip::make_address(address);
  std::vector<std::string> hosts = {AsHost(listening)};
  if (listening.is_loopback()) return hosts;
  if (listening.is_unspecified()) {
    const std::optional<ip::address> reached = FirstForOthers(listening.is_v6());
    hosts = {reached ? AsHost(*reached) : "localhost"};
  }
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) == 0) {
    hosts.emplace_back(name.data());
    hosts.push_back(fmt::format("{}.local", name.data()));
  }
  return hosts;
}

}  // namespace deepuav
