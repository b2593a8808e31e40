#pragma once

#include <utility>  // Asio's coroutines need it and do not say so.

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>

#include "deepuav/viewer/view_server.h"

namespace deepuav {

/// The clients that get messages; everything happens in the server's thread.
class Viewers {
 public:
  using Stream = boost::beast::tcp_stream;
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  template <typename Result = void>
  using Task = boost::asio::awaitable<Result>;

  /// `model` and `context` must outlive it.
  Viewers(ViewModel* model, const ViewServerOptions& options, boost::asio::io_context* context)
      : model_(model), options_(options), context_(context) {}

  /// Whether one more may look: there is room, or someone who does not show that he reads makes it.
  bool HaveRoom() const;
  /// Until the client goes or is shut out. There must be room for it.
  Task<> Watch(Stream stream, Request request);
  /// Shuts those out that do not take what they are sent.
  void ShutOutBlocked() const;
  /// From now on whoever has got everything is bidden farewell.
  void End() { is_end_ = true; }
  bool empty() const { return viewers_.empty(); }

 private:
  struct Viewer {
    explicit Viewer(Stream stream) : socket(std::move(stream)) {}
    boost::beast::websocket::stream<Stream> socket;
    std::optional<Stopwatch> since_write_began;
    Stopwatch since_counted;
    int messages = 0;  ///< From it, since counted.
    bool is_over = false;
    std::string question;   ///< A ping that waits for its answer: what it holds.
    Stopwatch since_shown;  ///< That it has read up to a question, or since it came.
    bool has_shown_once = false;
  };
  using ViewerPtr = std::shared_ptr<Viewer>;

  void Prepare(Viewer* viewer);
  Task<> Listen(ViewerPtr viewer);
  Task<> SendAll(ViewerPtr viewer);
  Task<bool> Send(Viewer* viewer, const ViewMessage& message);
  Task<bool> Ask(Viewer* viewer);
  void TakeAnswer(boost::beast::string_view answer, Viewer* viewer) const;
  ViewerPtr Slowest() const;
  void MakeRoom();
  void CountMessage(Viewer* viewer) const;
  void Close(Viewer* viewer) const;

  ViewModel* const model_;
  const ViewServerOptions options_;
  boost::asio::io_context* const context_;
  std::random_device random_;
  std::set<ViewerPtr> viewers_;
  bool is_end_ = false;
};

}  // namespace deepuav
