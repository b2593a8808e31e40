#include "deepuav/viewer/request_rate.h"

namespace deepuav {
namespace {

namespace ip = boost::asio::ip;

constexpr size_t kMostAddresses = 1000;  // That are remembered.

/// A server for both kinds of addresses sees the old ones as new ones.
ip::address Unmapped(const ip::address& address) {
  if (!address.is_v6() || !address.to_v6().is_v4_mapped()) return address;
  return ip::make_address_v4(ip::v4_mapped, address.to_v6());
}

}  // namespace

bool RequestRate::Count(const ip::address& address) {
  const ip::address asking = Unmapped(address);
  if (asking.is_loopback()) return true;
  if (seconds_.size() >= kMostAddresses) seconds_.clear();
  Second& second = seconds_[asking];
  if (second.since_began.Seconds() > 1) second = {};
  return ++second.requests <= most_per_s_;
}

}  // namespace deepuav
