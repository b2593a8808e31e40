#pragma once

#include <string>
#include <vector>

namespace deepuav {

/// Under which a server that listens at `address` is asked for: the address itself or, where that
/// stands for all, every address of this machine; and its names. The first is
/// one that others can ask for.
std::vector<std::string> OwnHosts(const std::string& address);

}  // namespace deepuav
