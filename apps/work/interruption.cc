#include "work/interruption.h"

#include <atomic>
#include <csignal>

#include "commands/commands.h"
#include "deepuav/io/files/temporary_files.h"

namespace deepuav {
namespace {

constexpr int kSignalStatusBase = 128;

std::atomic<int> signal_received = 0;  // Asked in other threads, too.
static_assert(std::atomic<int>::is_always_lock_free);

// What ends the program unless it is caught.
constexpr int kEndingSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGXCPU};

void CleanUpAndEnd(int signal) {
  RemoveTemporaryFiles();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void RememberSignal(int signal) {
  signal_received = signal;
  std::signal(signal, CleanUpAndEnd);
}

/// What nohup lets the program ignore stays ignored.
void Catch(int signal, void (*handler)(int)) {
  if (std::signal(signal, handler) == SIG_IGN && signal == SIGHUP) std::signal(signal, SIG_IGN);
}

}  // namespace

void CleanUpOnSignals() {
  for (const int signal : kEndingSignals) Catch(signal, CleanUpAndEnd);
  std::signal(SIGXFSZ, SIG_IGN);
}

void CatchSignals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) Catch(signal, RememberSignal);
}

int SignalReceived() { return signal_received; }

void ExitIfInterrupted() {
  if (signal_received != 0) throw ExitStatus{kSignalStatusBase + signal_received};
}

}  // namespace deepuav
