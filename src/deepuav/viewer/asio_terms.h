#pragma once

#include <utility>  // Asio's coroutines need it and do not say so.

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>

namespace deepuav {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using beast::error_code;

inline std::chrono::steady_clock::duration InSeconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(seconds));
}

/// Waits in a coroutine, which is told of problems in place of an exception.
inline auto Telling(error_code* problem) {
  return asio::redirect_error(asio::use_awaitable, *problem);
}

}  // namespace deepuav
