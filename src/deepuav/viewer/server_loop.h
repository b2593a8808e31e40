#pragma once

#include <utility>  // Asio's coroutines need it and do not say so.

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "deepuav/viewer/access_rules.h"
#include "deepuav/viewer/page_answers.h"
#include "deepuav/viewer/view_server.h"

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
  /// A client that gets messages.
  struct Viewer {
    explicit Viewer(Stream stream) : socket(std::move(stream)) {}
    boost::beast::websocket::stream<Stream> socket;
    std::optional<Stopwatch> since_write_began;
    Stopwatch since_counted;
    int messages = 0;  ///< From it, since counted.
    bool is_over = false;
  };
  using ViewerPtr = std::shared_ptr<Viewer>;

  Task<> Accept();
  Task<> Tick();
  Task<> Serve(std::shared_ptr<Stream> stream);
  Task<bool> Answer(Stream* stream, const Parser& parser);
  Task<bool> Refuse(Stream* stream, boost::beast::error_code problem);
  Task<> Watch(ViewerPtr viewer, Parser::value_type request);
  Task<> Listen(ViewerPtr viewer);
  Task<> SendAll(ViewerPtr viewer);
  void GoOnEnding();
  void MakeRoom();
  void CountMessage(Viewer* viewer) const;
  void Close(Viewer* viewer) const;
  bool MayWatch(const Parser::value_type& request, PageAnswer* refusal) const;

  ViewModel* const model_;
  const ViewServerOptions options_;
  boost::asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  AccessRules rules_;
  std::list<std::shared_ptr<Stream>> connections_;  ///< Not viewers, the oldest first.
  std::set<ViewerPtr> viewers_;
  std::optional<Stopwatch> since_stop_;
  bool all_is_told_ = false;  ///< What the model has is what viewers leave with.
};

}  // namespace deepuav
