#pragma once

#include <boost/asio/ip/address.hpp>
#include <map>

#include "deepuav/base/time.h"

namespace deepuav {

/// How often each address asked within a second.
class RequestRate {
 public:
  explicit RequestRate(int most_per_s) : most_per_s_(most_per_s) {}

  /// Counts that the address asks; whether it may. The loopback always may: all programs of this
  /// machine share it, so that one of them could lock the others out.
  bool Count(const boost::asio::ip::address& address);

 private:
  struct Second {
    Stopwatch since_began;
    int requests = 0;
  };
  const int most_per_s_;
  std::map<boost::asio::ip::address, Second> seconds_;
};

}  // namespace deepuav
