#pragma once

#include <string>
#include <vector>

namespace deepuav {

/// Under which a server that listens at `address` is asked for: the address itself or, where that
/// stands for all, one that others reach, if there is any yet; and this machine's names. The first
/// can be opened in a browser.
std::vector<std::string> OwnHosts(const std::string& address);

}  // namespace deepuav
