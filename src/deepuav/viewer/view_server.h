#pragma once

#include <memory>
#include <string>

#include "deepuav/base/option_bounds.h"
#include "deepuav/viewer/view_model.h"

namespace deepuav {

/// Where the page is served, and what is allowed to whom asks for it.
struct ViewServerOptions {
  std::string listen = "127.0.0.1";  ///< An address of this machine; others than its own: a token.
  int port = 8765;                   ///< 0: any that is free.
  int most_connections = 64;         ///< That have not become viewers; the oldest makes room.
  int most_viewers = 16;             ///< Who does not show that he reads makes room.
  int most_header_bytes = 8192;
  double request_timeout_s = 5;   ///< For a request to be complete.
  double write_timeout_s = 10;    ///< For a client to take a message.
  double silence_timeout_s = 20;  ///< Without a sign of life.
  double farewell_s = 5;          ///< At the end, for clients to take the newest of all.
  int most_messages_per_s = 20;   ///< From a client, which has nothing to say.
  int most_requests_per_s = 100;  ///< And connections, of an address other than the loopback.

  /// Throws Error for values that cannot be.
  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("listen", listen, "", "address of this machine");
    visit("port", port, "", "0: any that is free", Between(0, 65535));
    visit("most_connections", most_connections, "", "that have not become viewers",
          Between(1, 10'000));
    visit("most_viewers", most_viewers, "", "at a time", Between(1, 1'000));
    visit("most_header_bytes", most_header_bytes, "", "of a request", Between(512, 1'000'000));
    visit("request_timeout_s", request_timeout_s, "s", "for a request to be complete",
          Between(0.01, 3600));
    visit("write_timeout_s", write_timeout_s, "s", "for a client to take a message",
          Between(0.01, 3600));
    visit("silence_timeout_s", silence_timeout_s, "s", "without a sign of life",
          Between(0.01, 3600));
    visit("farewell_s", farewell_s, "s", "at the end, for clients to take the newest of all",
          Between(0, 60));
    visit("most_messages_per_s", most_messages_per_s, "", "from a client", Between(1, 100'000));
    visit("most_requests_per_s", most_requests_per_s, "", "of an address", Between(1, 100'000));
  }
};

/// Serves the page on a thread of its own, of low priority. Nothing that clients do or leave undone
/// reaches anyone else.
class ViewServer {
 public:
  /// `model` must outlive it. Throws Error where the port cannot be had.
  ViewServer(ViewModel* model, const ViewServerOptions& options);
  /// Who looks gets what `model` was told last, and is bidden farewell.
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
