#include "deepuav/viewer/view_server.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <thread>

#include "deepuav/base/option_bounds.h"
#include "deepuav/viewer/server_loop.h"

namespace deepuav {
namespace {

/// The run comes first. On Linux a thread has a niceness of its own.
void LowerPriority() {
  constexpr int kNiceness = 10;
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNiceness);
}

}  // namespace

void ViewServerOptions::Check() const {
  CheckRange("port", port, 0, 65535);
  CheckRange("most_connections", most_connections, 1, 10'000);
  CheckRange("most_viewers", most_viewers, 1, 1'000);
  CheckRange("most_header_bytes", most_header_bytes, 512, 1'000'000);
  CheckRange("request_timeout_s", request_timeout_s, 0.01, 3600);
  CheckRange("write_timeout_s", write_timeout_s, 0.01, 3600);
  CheckRange("silence_timeout_s", silence_timeout_s, 0.01, 3600);
  CheckRange("most_messages_per_s", most_messages_per_s, 1, 100'000);
}

class ViewServer::Loop {
 public:
  Loop(ViewModel* model, const ViewServerOptions& options)
      : loop(model, options), thread_([this] {
          LowerPriority();
          loop.Run();
        }) {}
  ~Loop() {
    loop.Stop();
    thread_.join();
  }

  ServerLoop loop;

 private:
  std::thread thread_;
};

ViewServer::ViewServer(ViewModel* model, const ViewServerOptions& options)
    : loop_(std::make_unique<Loop>(model, options)) {}

ViewServer::~ViewServer() = default;

std::string ViewServer::Url() const { return loop_->loop.Url(); }

}  // namespace deepuav
