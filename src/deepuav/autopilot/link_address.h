#pragma once

#include <string>

namespace deepuav {

/// Where an autopilot listens.
struct LinkAddress {
  std::string host;
  int port = 0;
};

/// Of `udp:HOST:PORT`, an IPv6 address in brackets. Throws Error for another text.
LinkAddress ParseLinkAddress(const std::string& text);

}  // namespace deepuav
