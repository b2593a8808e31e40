#include "interruption.h"

#include <atomic>
#include <csignal>

#include "commands.h"

namespace deepuav {
namespace {

constexpr int kSignalStatusBase = 128;

std::atomic<int> signal_received = 0;  // Asked in other threads, too.
static_assert(std::atomic<int>::is_always_lock_free);

void RememberSignal(int signal) {
  signal_received = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void CatchSignals() {
  std::signal(SIGINT, RememberSignal);
  std::signal(SIGTERM, RememberSignal);
}

int SignalReceived() { return signal_received; }

void ExitIfInterrupted() {
  if (signal_received != 0) throw ExitStatus{kSignalStatusBase + signal_received};
}

}  // namespace deepuav
