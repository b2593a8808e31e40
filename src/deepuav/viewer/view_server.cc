#include "deepuav/viewer/view_server.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <thread>

#include "deepuav/base/option_check.h"
#include "deepuav/viewer/server_loop.h"

namespace deepuav {
namespace {

/// The run comes first. On Linux a thread has a niceness of its own.
void LowerPriority() {
  constexpr int kNiceness = 10;
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNiceness);
}

}  // namespace

void ViewServerOptions::Check() const { CheckOptions("", *this); }

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
