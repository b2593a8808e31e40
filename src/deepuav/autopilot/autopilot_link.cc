#include "deepuav/autopilot/autopilot_link.h"

#include <utility>  // Asio's coroutines need it and do not say so.

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <thread>

#include "deepuav/autopilot/steady_image_clock.h"
#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;
using SteadyClock = std::chrono::steady_clock;

constexpr size_t kMostDatagram = 2048;  // Bytes; no message is longer.
constexpr auto kPause = std::chrono::milliseconds(10);
constexpr int kMostDatagramsPerPause = 20;  // 2,000 a second.

auto Telling(error_code* problem) { return asio::redirect_error(asio::use_awaitable, *problem); }

SteadyClock::duration Interval(double rate_hz) {
  return std::chrono::duration_cast<SteadyClock::duration>(
      std::chrono::duration<double>(1 / rate_hz));
}

}  // namespace

class AutopilotLink::Loop {
 public:
  Loop(const LinkAddress& address, const AutopilotOptions& options, Ask ask, AutopilotListener told)
      : session_(options, SteadyNow(), std::move(told)),
        interval_(Interval(options.rate_hz)),
        ask_(std::move(ask)) {
    Connect(address);
    asio::co_spawn(context_, Talk(), asio::detached);
    asio::co_spawn(context_, Listen(), asio::detached);
    thread_ = std::thread([this] { Run(); });
  }
  ~Loop() {
    context_.stop();
    thread_.join();
  }

 private:
  /// From then on only what the autopilot itself sends comes.
  void Connect(const LinkAddress& address) {
    error_code problem;
    const auto found = udp::resolver(context_).resolve(address.host, std::to_string(address.port),
                                                       udp::resolver::numeric_service, problem);
    if (!problem && found.empty()) problem = asio::error::host_not_found;
    if (!problem) socket_.open(found.begin()->endpoint().protocol(), problem);
    if (!problem) socket_.connect(found.begin()->endpoint(), problem);
    if (!problem) socket_.non_blocking(true, problem);
    if (problem) {
      throw Error("autopilot at {} port {}: cannot be reached: {}", address.host, address.port,
                  problem.message());
    }
  }

  void Run() {
    while (!context_.stopped()) {
      try {
        context_.run();
      } catch (const std::exception& error) {
        Log().debug("autopilot: {}", error.what());
      }
    }
  }

  asio::awaitable<void> Talk() {
    asio::steady_timer timer(context_);
    auto next = SteadyClock::now();
    while (true) {
      const int64_t now_ns = SteadyNow();
      Send(session_.Due(ask_(now_ns), now_ns));
      // What was missed, as while the machine slept, is not made up for.
      next = std::max(next + interval_, SteadyClock::now());
      timer.expires_at(next);
      error_code problem;
      co_await timer.async_wait(Telling(&problem));
    }
  }

  asio::awaitable<void> Listen() {
    std::array<char, kMostDatagram> buffer;
    asio::steady_timer pause(context_);
    int datagrams = 0;
    while (true) {
      error_code problem;
      const size_t size = co_await socket_.async_receive(asio::buffer(buffer), Telling(&problem));
      // An error says that nobody listens, or what else befell a message of ours.
      if (!problem) Send(session_.Hear({buffer.data(), size}, SteadyNow()));
      if (!problem && ++datagrams < kMostDatagramsPerPause) continue;
      datagrams = 0;
      pause.expires_after(kPause);
      co_await pause.async_wait(Telling(&problem));
    }
  }

  /// What does not go out at once is old when it does.
  void Send(const std::vector<std::string>& datagrams) {
    for (const std::string& datagram : datagrams) {
      error_code problem;
      socket_.send(asio::buffer(datagram), 0, problem);
    }
  }

  AutopilotSession session_;
  const SteadyClock::duration interval_;
  const Ask ask_;
  asio::io_context context_{1};
  udp::socket socket_{context_};
  std::thread thread_;
};

AutopilotLink::AutopilotLink(const LinkAddress& address, const AutopilotOptions& options, Ask ask,
                             AutopilotListener told)
    : loop_(std::make_unique<Loop>(address, options, std::move(ask), std::move(told))) {}

AutopilotLink::~AutopilotLink() = default;

}  // namespace deepuav
