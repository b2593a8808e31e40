#include "deepuav/viewer/request_rate.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace deepuav {
namespace {

constexpr int kMost = 3;

boost::asio::ip::address Address(const char* text) { return boost::asio::ip::make_address(text); }

TEST(RequestRate, BoundsEachAddressForASecond) {
  RequestRate rate(kMost);
  for (int i = 0; i < kMost; ++i) EXPECT_TRUE(rate.Count(Address("10.0.0.2")));
  EXPECT_FALSE(rate.Count(Address("10.0.0.2")));
  EXPECT_FALSE(rate.Count(Address("::ffff:10.0.0.2")));
  EXPECT_TRUE(rate.Count(Address("10.0.0.3")));
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  EXPECT_TRUE(rate.Count(Address("10.0.0.2")));
}

TEST(RequestRate, IsNotOfTheLoopback) {
  RequestRate rate(kMost);
  for (const char* own : {"127.0.0.1", "::1", "::ffff:127.0.0.1"}) {
    for (int i = 0; i < 10 * kMost; ++i) EXPECT_TRUE(rate.Count(Address(own))) << own;
  }
}

}  // namespace
}  // namespace deepuav
