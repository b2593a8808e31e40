#pragma once

#include <utility>  // Asio's coroutines need it and do not say so.

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "deepuav/viewer/access_rules.h"
#include "deepuav/viewer/page_answers.h"
#include "deepuav/viewer/request_rate.h"
#include "deepuav/viewer/view_server.h"
#include "deepuav/viewer/viewers.h"

namespace deepuav {

/// The server's connections; everything happens in one thread.
class ServerLoop {
 public:
  using tcp = boost::asio::ip::tcp;
  using Stream = boost::beast::tcp_stream;
  template <typename Result = void>
  using Task = boost::asio::awaitable<Result>;
  using Parser = boost::beast::http::request_parser<boost::beast::http::empty_body>;

  ServerLoop(ViewModel* model, const ViewServerOptions& options);

  /// Until all viewers have got what there was when Stop() was called.
  void Run();
  /// Thread-safe.
  void Stop();
  std::string Url() const;

 private:
  Task<> Accept();
  Task<> Tick();
  Task<> Serve(std::shared_ptr<Stream> stream, boost::asio::ip::address client);
  Task<bool> Answer(Stream* stream, const Parser& parser);
  Task<bool> Respond(Stream* stream, const PageAnswer& answer, std::string_view host, bool goes_on);
  Task<> Refuse(Stream* stream, boost::beast::error_code problem);
  void GoOnEnding();
  void MakeRoom();
  bool MayWatch(const Parser::value_type& request, PageAnswer* refusal) const;

  ViewModel* const model_;
  const ViewServerOptions options_;
  boost::asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  AccessRules rules_;
  RequestRate rate_{options_.most_requests_per_s};
  std::list<std::shared_ptr<Stream>> connections_;  ///< Not viewers, the oldest first.
  Viewers viewers_{model_, options_, &context_};
  std::optional<Stopwatch> since_stop_;
  bool all_is_told_ = false;  ///< What the model has is what viewers leave with.
};

}  // namespace deepuav
