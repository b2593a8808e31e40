#include "deepuav/viewer/own_addresses.h"

#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <unistd.h>

#include <array>
#include <boost/asio/ip/address.hpp>
#include <cstring>

namespace deepuav {
namespace {

namespace ip = boost::asio::ip;

std::string AsHost(const ip::address& address) {
  return address.is_v6() ? fmt::format("[{}]", address.to_string()) : address.to_string();
}

/// Those that hold on one interface only are left out: no browser takes them.
void AddInterface(const ifaddrs& entry, std::vector<std::string>* hosts) {
  if (!entry.ifa_addr) return;
  if (entry.ifa_addr->sa_family == AF_INET) {
    sockaddr_in found{};
    std::memcpy(&found, entry.ifa_addr, sizeof(found));
    const ip::address_v4 address(ntohl(found.sin_addr.s_addr));
    // The first that others reach leads.
    const bool leads = !address.is_loopback() && hosts->front() == ip::address_v4().to_string();
    hosts->insert(leads ? hosts->begin() : hosts->end(), AsHost(address));
  } else if (entry.ifa_addr->sa_family == AF_INET6) {
    sockaddr_in6 found{};
    std::memcpy(&found, entry.ifa_addr, sizeof(found));
    ip::address_v6::bytes_type bytes{};
    std::memcpy(bytes.data(), &found.sin6_addr, bytes.size());
    const ip::address_v6 address(bytes);
    if (!address.is_link_local()) hosts->push_back(AsHost(address));
  }
}

}  // namespace

std::vector<std::string> OwnHosts(const std::string& address) {
  const ip::address listening = ip::make_address(address);
  std::vector<std::string> hosts = {AsHost(listening)};
  if (listening.is_loopback() || listening.is_unspecified()) hosts.emplace_back("localhost");
  if (listening.is_loopback()) return hosts;
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) == 0) {
    hosts.emplace_back(name.data());
    hosts.push_back(fmt::format("{}.local", name.data()));
  }
  ifaddrs* interfaces = nullptr;
  if (!listening.is_unspecified() || ::getifaddrs(&interfaces) != 0) return hosts;
  for (const ifaddrs* entry = interfaces; entry; entry = entry->ifa_next)
    AddInterface(*entry, &hosts);
  ::freeifaddrs(interfaces);
  return hosts;
}

}  // namespace deepuav
