#pragma once

#include <memory>
#include <string>

#include "deepuav/viewer/view_model.h"

namespace deepuav {

/// Where the page is served, and what is allowed to whom asks for it.
struct ViewServerOptions {
  std::string listen = "127.0.0.1";  ///< An address of this machine; others than its own: a token.
  int port = 8765;                   ///< 0: any that is free.
  int most_connections = 64;         ///< That have not become viewers; the oldest makes room.
  int most_viewers = 16;
  int most_header_bytes = 8192;
  double request_timeout_s = 5;   ///< For a request to be complete.
  double write_timeout_s = 10;    ///< For a client to take a message.
  double silence_timeout_s = 20;  ///< Without a sign of life.
  int most_messages_per_s = 20;   ///< From a client, which has nothing to say.

  /// Throws Error for values that cannot be.
  void Check() const;
};

/// Serves the page on a thread of its own, of low priority. Nothing that clients do or leave undone
/// reaches anyone else.
class ViewServer {
 public:
  /// `model` must outlive it. Throws Error where the port cannot be had.
  ViewServer(ViewModel* model, const ViewServerOptions& options);
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// To be opened in a browser; holds the token where one is needed.
  std::string Url() const;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace deepuav
